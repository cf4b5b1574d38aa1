// libalces-client: the poses of a running alcesd, from its shared page (alces/page.h). C11 and C++.
//
//   alces_client* client = alces_client_open(NULL);
//   alces_pose pose;
//   int result = alces_client_latest(client, ALCES_MAP_FROM_BODY, &pose);
//   if (result == ALCES_OK) ...                           // now
//   else if (result > ALCES_OK) ...                       // filled in, but old: pose.age_ns
//   else puts(alces_client_text(result));                 // nothing
//
// Reading makes no system call and takes about a microsecond; nobody waits for a reader. Only while there is
// no page, or its alcesd has ended or stands still, the file is looked for again, every 100 ms: so a client
// may start before alcesd, and it follows a restart by itself. A pose says which start it is of: maps of two
// starts have nothing in common.
//
// Stamps are ns of CLOCK_MONOTONIC (time.monotonic_ns() in Python, std::chrono::steady_clock). Frames (REP
// 105): odom goes on smoothly and drifts; map is right in the long run, and jumps when a scan or a loop
// corrects it. body is x ahead, y to the left, z up.
//
// A client is for one thread at a time; open one for each.
#ifndef ALCES_CLIENT_H
#define ALCES_CLIENT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define ALCES_CLIENT_API __attribute__((visibility("default")))
#else
#define ALCES_CLIENT_API
#endif

typedef struct alces_client alces_client;

// Below 0: nothing was filled in. Above 0: it was, and is old.
typedef enum alces_result {
  ALCES_OK = 0,
  ALCES_STALE = 1,           // alcesd or the odometry stands still, or no scan comes: see the age
  ALCES_ENDED = 2,           // the last of an alcesd that has ended
  ALCES_NO_PAGE = -1,        // there is no file: alcesd does not run, or [page] names another
  ALCES_NO_PERMISSION = -2,  // the file is another group's: [page] group
  ALCES_BAD_PAGE = -3,       // the file is no page, or was cut off
  ALCES_OTHER_VERSION = -4,  // of another libalces-client
  ALCES_UNSETTLED = -5,      // alcesd died, or is held up, in the middle of writing
  ALCES_NOT_YET = -6,        // there is none yet; or the time asked for is later than is known
  ALCES_TOO_OLD = -7,        // the time asked for is before what is remembered (about 20 s)
  ALCES_GAP = -8,            // the odometry was away at that time
  ALCES_NO_EVENT = -9,       // no further one
  ALCES_EVENTS_LOST = -10,   // older ones were overwritten before they were read; the next call goes on
  ALCES_RESTARTED = -11,     // events that follow are of a new start of alcesd
  ALCES_BAD_ARGUMENT = -12
} alces_result;

// Never null; static.
ALCES_CLIENT_API const char* alces_client_text(int result);

typedef enum alces_transform {
  ALCES_ODOM_FROM_BODY = 0,
  ALCES_MAP_FROM_ODOM = 1,
  ALCES_MAP_FROM_BODY = 2
} alces_transform;

typedef struct alces_pose {
  uint64_t start_id;      // of the alcesd that said it
  uint64_t sequence;      // counts publications of the transform's newest part
  uint64_t map_sequence;  // of map -> odom in it; 0: there is none in it
  int64_t stamp_ns;       // the time that it holds at
  int64_t map_stamp_ns;   // of the scan that map -> odom was found by; 0: there is none in it
  int64_t age_ns;         // from stamp_ns to now
  double position_m[3];   // of the child in the parent
  double orientation_xyzw[4];
  // Row by row, of x, y, z, and the rotation about x, y, z, along the axes of the parent frame, at the body.
  // That of map -> odom is the map's own share, as of map_stamp_ns; that of odom -> body grows since the
  // start.
  double covariance[36];
  double velocity[6];       // of the body along its own axes, m/s and rad/s; 0 for ALCES_MAP_FROM_ODOM
  int32_t is_extrapolated;  // past the newest message of the odometry
  int32_t is_of_scan;       // ALCES_MAP_FROM_BODY where no odometry carries it on: of the newest scan
} alces_pose;

typedef struct alces_status {
  uint64_t start_id;
  int64_t start_ns;
  int64_t alive_age_ns;  // since alcesd wrote its last
  uint64_t scans;        // assembled
  uint64_t scans_mapped;
  uint64_t scans_dropped;
  uint64_t loops_closed;
  uint64_t loops_refused;
  int64_t latency_median_ns;  // from a scan's last ray to its pose here; of the last 64 scans; 0: none yet
  int64_t latency_worst_ns;   // since the start
  int64_t mapper_hung_ns;     // the mapper has not come back from a scan for so long
  double scans_per_s;
  int32_t pid;
  int32_t map_verdict;  // 0 good, 1 doubtful, 2 bad
  int32_t map_parts;    // that nothing ties together
  int32_t is_odometry_valid;
  int32_t is_scanning;
  int32_t is_mapping;
  int32_t is_map_full;
  int32_t is_archive_stalled;
  int32_t is_recording;
  int32_t is_recording_stalled;
  char phase[64];  // words for people
  char reason[128];
  char doubt[128];  // why the map is not good
} alces_status;

typedef struct alces_event {
  uint64_t start_id;
  uint64_t sequence;  // from 1
  int64_t stamp_ns;   // of the scan that closed the loop, or would have
  int64_t published_ns;
  double distance_m;      // between the two places before, in the map
  double correction_m;    // how far the newer scan moved
  double correction_rad;  // and turned
  int32_t is_closed;      // 0: refused
  uint32_t first_scan;
  uint32_t last_scan;
  int32_t reserved;
  char verdict[64];  // for people
} alces_event;

// `path` null: /run/alces/page. The page need not be there yet. Null: no memory, or the path is too long.
ALCES_CLIENT_API alces_client* alces_client_open(const char* path);
// `client` may be null.
ALCES_CLIENT_API void alces_client_close(alces_client* client);

// The newest. OK, STALE, ENDED, NOT_YET, UNSETTLED, and why there is no page.
ALCES_CLIENT_API int alces_client_latest(alces_client* client, alces_transform transform, alces_pose* pose);

// At a time: between two poses of the odometry, or up to 100 ms past the newest by its velocity. map -> odom
// is always the newest: a past pose, too, is given in the map as it is now. OK, STALE, ENDED, NOT_YET,
// TOO_OLD, GAP, UNSETTLED, and why there is no page. O(log 1024).
ALCES_CLIENT_API int alces_client_pose_at(alces_client* client, alces_transform transform, int64_t stamp_ns,
                                          alces_pose* pose);

// OK, STALE, ENDED, NOT_YET, UNSETTLED, and why there is no page.
ALCES_CLIENT_API int alces_client_status(alces_client* client, alces_status* status);

// The next loop, from the oldest that is remembered (64) on. OK, NO_EVENT, EVENTS_LOST, RESTARTED,
// UNSETTLED, and why there is no page.
ALCES_CLIENT_API int alces_client_next_event(alces_client* client, alces_event* event);

// Another clock than CLOCK_MONOTONIC, for a simulated alcesd. Null: CLOCK_MONOTONIC.
ALCES_CLIENT_API void alces_client_set_clock(alces_client* client, int64_t (*now_ns)(void* context),
                                             void* context);

#ifdef __cplusplus
}
#endif

#endif
