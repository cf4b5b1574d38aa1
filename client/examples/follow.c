// Where the vehicle is, ten times a second, and each loop. With a path: another page than /run/alces/page.
//   cc follow.c $(pkg-config --cflags --libs alces-client) -lm -o follow && ./follow
#include <alces/client.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static void print_pose(alces_client* client) {
  alces_pose pose;
  const int result = alces_client_latest(client, ALCES_MAP_FROM_BODY, &pose);
  if (result < 0) {
    printf("no pose: %s\n", alces_client_text(result));
    return;
  }
  printf("%8.2f %8.2f %8.2f m, +-%.2f m, %.3f s old%s%s\n", pose.position_m[0], pose.position_m[1],
         pose.position_m[2], sqrt(pose.covariance[0] + pose.covariance[7]), (double)pose.age_ns * 1e-9,
         result == ALCES_OK ? "" : ": ", result == ALCES_OK ? "" : alces_client_text(result));
}

static void print_events(alces_client* client) {
  alces_event event;
  int result;
  while ((result = alces_client_next_event(client, &event)) != ALCES_NO_EVENT) {
    if (result == ALCES_RESTARTED || result == ALCES_EVENTS_LOST) {
      printf("%s\n", alces_client_text(result));
    } else if (result != ALCES_OK) {
      return;
    } else {
      printf("loop %" PRIu32 "-%" PRIu32 " %s, moved %.2f m\n", event.first_scan, event.last_scan,
             event.verdict, event.correction_m);
    }
  }
}

// follow [PAGE [TIMES]]
int main(int argc, char** argv) {
  alces_client* const client = alces_client_open(argc > 1 ? argv[1] : NULL);
  if (client == NULL) return 1;
  const long times = argc > 2 ? strtol(argv[2], NULL, 10) : -1;
  for (long i = 0; i != times; ++i) {
    print_events(client);
    print_pose(client);
    fflush(stdout);
    const struct timespec pause = {0, 100000000};
    nanosleep(&pause, NULL);
  }
  alces_client_close(client);
  return 0;
}
