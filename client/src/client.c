#define _GNU_SOURCE
#include "alces/client.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "alces/page.h"
#include "mapping.h"
#include "rigid.h"

#define LOOK_AGAIN_NS INT64_C(100000000)
#define SLOPE_M 10.0  // the ground rises alike for so long

struct alces_client {
  struct mapping mapping;
  int64_t (*clock)(void* context);
  void* clock_context;
  int has_looked;
  int64_t looked_ns;
  int look_result;
  uint64_t events_start_id;  // 0: none was read yet
  uint64_t next_event;
  char path[4096];
};

// What a call works with: one look at the page.
struct view {
  const struct alces_page* page;
  int64_t now_ns;
  int result;  // OK, STALE, ENDED
  struct alces_page_odometry odometry;
  struct alces_page_map map;
};

const char* alces_client_text(int result) {
  switch (result) {
    case ALCES_OK:
      return "ok";
    case ALCES_STALE:
      return "old: alcesd or the odometry stands still, or no scan comes";
    case ALCES_ENDED:
      return "the last of an alcesd that has ended";
    case ALCES_NO_PAGE:
      return "there is no page: does alcesd run, and does [page] name this file?";
    case ALCES_NO_PERMISSION:
      return "the page may not be read: be in the group that [page] names";
    case ALCES_BAD_PAGE:
      return "this file is no page, or was cut off";
    case ALCES_OTHER_VERSION:
      return "the page is of another version than this libalces-client: install the one of alcesd";
    case ALCES_UNSETTLED:
      return "what was read changed all the time: try again";
    case ALCES_NOT_YET:
      return "there is none yet";
    case ALCES_TOO_OLD:
      return "before what is remembered";
    case ALCES_GAP:
      return "the odometry was away at that time";
    case ALCES_NO_EVENT:
      return "no further event";
    case ALCES_EVENTS_LOST:
      return "events were overwritten before they were read";
    case ALCES_RESTARTED:
      return "alcesd was started again";
    case ALCES_BAD_ARGUMENT:
      return "an argument cannot be";
    default:
      return "unknown";
  }
}

static int64_t monotonic_ns(void* context) {
  (void)context;
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

alces_client* alces_client_open(const char* path) {
  if (path == NULL) path = ALCES_PAGE_DEFAULT_PATH;
  alces_client* const client = calloc(1, sizeof *client);
  if (client == NULL || strlen(path) >= sizeof client->path) {
    free(client);
    return NULL;
  }
  strcpy(client->path, path);
  client->clock = monotonic_ns;
  client->next_event = 1;
  return client;
}

void alces_client_close(alces_client* client) {
  if (client == NULL) return;
  mapping_drop(&client->mapping);
  free(client);
}

void alces_client_set_clock(alces_client* client, int64_t (*now_ns)(void* context), void* context) {
  client->clock = now_ns != NULL ? now_ns : monotonic_ns;
  client->clock_context = context;
  client->has_looked = 0;
}

// Sections are copied word by word, and become structs here.

static int read_odometry(const struct alces_page* page, struct alces_page_odometry* odometry) {
  uint32_t words[ALCES_PAGE_WORDS(*odometry)];
  if (!alces_page_read(page->odometry, words, ALCES_PAGE_WORDS(*odometry))) return 0;
  memcpy(odometry, words, sizeof *odometry);
  return 1;
}

static int read_map(const struct alces_page* page, struct alces_page_map* map) {
  uint32_t words[ALCES_PAGE_WORDS(*map)];
  if (!alces_page_read(page->map, words, ALCES_PAGE_WORDS(*map))) return 0;
  memcpy(map, words, sizeof *map);
  return 1;
}

static int read_status(const struct alces_page* page, struct alces_page_status* status) {
  uint32_t words[ALCES_PAGE_WORDS(*status)];
  if (!alces_page_read(page->status, words, ALCES_PAGE_WORDS(*status))) return 0;
  memcpy(status, words, sizeof *status);
  return 1;
}

static int read_node(const struct alces_page* page, uint64_t sequence, struct alces_page_node* node) {
  uint32_t words[ALCES_PAGE_WORDS(*node)];
  if (!alces_page_load(page->nodes[(sequence - 1) % ALCES_PAGE_NODES], words, ALCES_PAGE_WORDS(*node)))
    return ALCES_TOO_OLD;  // just now overwritten
  memcpy(node, words, sizeof *node);
  return node->sequence == sequence ? ALCES_OK : ALCES_TOO_OLD;
}

static int read_event(const struct alces_page* page, uint64_t sequence, struct alces_page_event* event) {
  uint32_t words[ALCES_PAGE_WORDS(*event)];
  if (!alces_page_load(page->events[(sequence - 1) % ALCES_PAGE_EVENTS], words, ALCES_PAGE_WORDS(*event)))
    return ALCES_EVENTS_LOST;  // just now overwritten
  memcpy(event, words, sizeof *event);
  return event->sequence == sequence ? ALCES_OK : ALCES_EVENTS_LOST;
}

// The page, and whether it is of now.

static int may_look(alces_client* client, int64_t now_ns) {
  const int64_t since_ns = now_ns - client->looked_ns;
  if (client->has_looked && since_ns >= 0 && since_ns < LOOK_AGAIN_NS) return 0;
  client->has_looked = 1;
  client->looked_ns = now_ns;
  return 1;
}

static uint32_t state_of(const struct alces_page* page) {
  return __atomic_load_n(&page->head.state, __ATOMIC_ACQUIRE);
}

static int judge(struct view* view) {
  if (!read_odometry(view->page, &view->odometry)) return ALCES_UNSETTLED;
  if (state_of(view->page) != ALCES_PAGE_LIVE) return ALCES_ENDED;
  const int64_t silent_ns = view->now_ns - view->odometry.alive_ns;
  const int is_alive = silent_ns <= ALCES_PAGE_ALIVE_LIMIT_NS && silent_ns >= -ALCES_PAGE_ALIVE_LIMIT_NS;
  return is_alive ? ALCES_OK : ALCES_STALE;
}

// Below 0: nothing can be had.
static int look(alces_client* client, struct view* view) {
  view->now_ns = client->clock(client->clock_context);
  view->page = client->mapping.page;
  view->result = view->page != NULL ? judge(view) : ALCES_NO_PAGE;
  if (view->result == ALCES_OK) return ALCES_OK;
  if (may_look(client, view->now_ns)) client->look_result = mapping_look(&client->mapping, client->path);
  if (client->mapping.page == NULL) return client->look_result;
  if (client->mapping.page != view->page) {
    view->page = client->mapping.page;
    view->result = judge(view);
  }
  // An old page, and a file that is there and cannot be used: that is what has to be told.
  const int is_over = view->result == ALCES_ENDED || view->result == ALCES_STALE;
  if (is_over && client->look_result != ALCES_OK && client->look_result != ALCES_NO_PAGE)
    return client->look_result;
  return view->result;
}

static int look_with_map(alces_client* client, struct view* view) {
  const int result = look(client, view);
  if (result < 0) return result;
  return read_map(view->page, &view->map) ? result : ALCES_UNSETTLED;
}

// The worse of the two, where both have something to show.
static int with_limit(const struct view* view, int64_t stamp_ns, int64_t limit_ns) {
  if (view->result != ALCES_OK) return view->result;
  return view->now_ns - stamp_ns > limit_ns ? ALCES_STALE : ALCES_OK;
}

static void set_place(alces_pose* pose, const rigid* place) {
  memcpy(pose->position_m, place->position_m, sizeof pose->position_m);
  memcpy(pose->orientation_xyzw, place->orientation_xyzw, sizeof pose->orientation_xyzw);
}

static void begin_pose(const struct view* view, int64_t stamp_ns, uint64_t sequence, alces_pose* pose) {
  memset(pose, 0, sizeof *pose);
  pose->start_id = view->page->head.start_id;
  pose->sequence = sequence;
  pose->stamp_ns = stamp_ns;
  pose->age_ns = view->now_ns - stamp_ns;
}

static void set_map(const struct view* view, alces_pose* pose) {
  pose->map_sequence = view->map.map_from_odom.sequence;
  pose->map_stamp_ns = view->map.map_from_odom.stamp_ns;
}

// odom -> body.

static int latest_odometry(const struct view* view, alces_pose* pose) {
  const struct alces_page_odometry* const odometry = &view->odometry;
  const struct alces_page_transform* const newest = &odometry->odom_from_body;
  if (newest->sequence == 0) return ALCES_NOT_YET;
  begin_pose(view, newest->stamp_ns, newest->sequence, pose);
  set_place(pose, &newest->parent_from_child);
  memcpy(pose->covariance, newest->covariance, sizeof pose->covariance);
  memcpy(pose->velocity, odometry->velocity, sizeof pose->velocity);
  pose->is_extrapolated = newest->stamp_ns > odometry->node_stamp_ns;
  if (view->result == ALCES_OK && !odometry->is_valid) return ALCES_STALE;
  return with_limit(view, newest->stamp_ns, ALCES_PAGE_ALIVE_LIMIT_NS);
}

// The last node at or before the time, and the one after it.
static int find_nodes(const struct view* view, int64_t stamp_ns, struct alces_page_node* before,
                      struct alces_page_node* after) {
  uint64_t high = view->odometry.nodes;  // its stamp is after the time
  uint64_t low = high > ALCES_PAGE_NODES - 1 ? high - (ALCES_PAGE_NODES - 2) : 1;
  int result = read_node(view->page, low, before);
  if (result != ALCES_OK) return result;
  if (before->stamp_ns > stamp_ns) return ALCES_TOO_OLD;
  result = read_node(view->page, high, after);
  while (result == ALCES_OK && low + 1 < high) {
    const uint64_t middle = low + (high - low) / 2;
    struct alces_page_node node;
    result = read_node(view->page, middle, &node);
    if (result != ALCES_OK) break;
    if (node.stamp_ns <= stamp_ns) {
      low = middle;
      *before = node;
    } else {
      high = middle;
      *after = node;
    }
  }
  return result;
}

static void set_velocity_between(const rigid* from, const rigid* to, double duration_s, alces_pose* pose) {
  const rigid inverse = rigid_inverse(from);
  const rigid step = rigid_product(&inverse, to);
  const double sign = step.orientation_xyzw[3] < 0 ? -2 : 2;
  for (int i = 0; i < 3; ++i) {
    pose->velocity[i] = step.position_m[i] / duration_s;
    pose->velocity[i + 3] = sign * step.orientation_xyzw[i] / duration_s;
  }
}

static int odometry_ahead(const struct view* view, int64_t stamp_ns, const struct alces_page_node* newest,
                          alces_pose* pose) {
  if (stamp_ns - newest->stamp_ns > ALCES_PAGE_AHEAD_LIMIT_NS) return ALCES_NOT_YET;
  if (!view->odometry.is_valid && stamp_ns > newest->stamp_ns) return ALCES_GAP;
  const rigid ahead = rigid_ahead(&newest->odom_from_body, view->odometry.velocity,
                                  (double)(stamp_ns - newest->stamp_ns) * 1e-9);
  set_place(pose, &ahead);
  memcpy(pose->velocity, view->odometry.velocity, sizeof pose->velocity);
  pose->is_extrapolated = stamp_ns > newest->stamp_ns;
  return view->result;
}

static int odometry_at(const struct view* view, int64_t stamp_ns, alces_pose* pose) {
  if (view->odometry.nodes == 0) return ALCES_NOT_YET;
  begin_pose(view, stamp_ns, view->odometry.odom_from_body.sequence, pose);
  memcpy(pose->covariance, view->odometry.odom_from_body.covariance, sizeof pose->covariance);
  struct alces_page_node before;
  struct alces_page_node after;
  int result = read_node(view->page, view->odometry.nodes, &after);
  if (result != ALCES_OK) return result;
  if (stamp_ns >= after.stamp_ns) return odometry_ahead(view, stamp_ns, &after, pose);
  result = find_nodes(view, stamp_ns, &before, &after);
  if (result != ALCES_OK) return result;
  if (!after.is_connected && before.stamp_ns != stamp_ns) return ALCES_GAP;
  const double duration_s = (double)(after.stamp_ns - before.stamp_ns) * 1e-9;
  const double fraction = (double)(stamp_ns - before.stamp_ns) * 1e-9 / duration_s;
  const rigid between = rigid_between(&before.odom_from_body, &after.odom_from_body, fraction);
  set_place(pose, &between);
  set_velocity_between(&before.odom_from_body, &after.odom_from_body, duration_s, pose);
  return view->result;
}

// map -> odom, and both together.

static int latest_correction(const struct view* view, alces_pose* pose) {
  const struct alces_page_transform* const correction = &view->map.map_from_odom;
  if (correction->sequence == 0) return ALCES_NOT_YET;
  begin_pose(view, correction->stamp_ns, correction->sequence, pose);
  set_place(pose, &correction->parent_from_child);
  memcpy(pose->covariance, correction->covariance, sizeof pose->covariance);
  set_map(view, pose);
  return with_limit(view, correction->stamp_ns, ALCES_PAGE_SCAN_LIMIT_NS);
}

static int scan_pose(const struct view* view, alces_pose* pose) {
  const struct alces_page_transform* const scan = &view->map.map_from_body;
  begin_pose(view, scan->stamp_ns, scan->sequence, pose);
  set_place(pose, &scan->parent_from_child);
  memcpy(pose->covariance, scan->covariance, sizeof pose->covariance);
  pose->is_of_scan = 1;
  return with_limit(view, scan->stamp_ns, ALCES_PAGE_SCAN_LIMIT_NS);
}

// What the odometry adds from the scan's pose on, along the map's axes.
static void add_growth(const struct alces_page_growth* growth, const rigid* from, const rigid* to,
                       double duration_s, double covariance[36]) {
  double way[3];
  for (int i = 0; i < 3; ++i) way[i] = to->position_m[i] - from->position_m[i];
  const double turn_rad = rigid_angle_between(from, to);
  const double heading2 = growth->turn * growth->turn * turn_rad * turn_rad +
                          growth->heading_rad_per_s * growth->heading_rad_per_s * duration_s * duration_s +
                          growth->heading_rad_per_sqrt_s * growth->heading_rad_per_sqrt_s * duration_s;
  const double across[2] = {-way[1], way[0]};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) covariance[6 * i + j] += growth->way * growth->way * way[i] * way[j];
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) covariance[6 * i + j] += heading2 / 3 * across[i] * across[j];
  }
  // The scan knows how the ground lay there.
  const double way2 = way[0] * way[0] + way[1] * way[1];
  const double tilt2 = growth->tilt_rad * growth->tilt_rad * fmin(1, sqrt(way2) / SLOPE_M);
  covariance[14] += tilt2 * way2;
  covariance[21] += tilt2;
  covariance[28] += tilt2;
  covariance[35] += heading2;
}

// `pose` is odom -> body, of `result`; it becomes map -> body.
static int into_map(const struct view* view, int result, alces_pose* pose) {
  const struct alces_page_transform* const correction = &view->map.map_from_odom;
  rigid odom_from_body;
  memcpy(odom_from_body.position_m, pose->position_m, sizeof pose->position_m);
  memcpy(odom_from_body.orientation_xyzw, pose->orientation_xyzw, sizeof pose->orientation_xyzw);
  const rigid map_from_body = rigid_product(&correction->parent_from_child, &odom_from_body);
  const rigid map_from_scan = rigid_product(&correction->parent_from_child, &view->map.odom_from_body);
  set_place(pose, &map_from_body);
  const double duration_s = fabs((double)(pose->stamp_ns - correction->stamp_ns) * 1e-9);
  covariance_carry(correction->covariance, &map_from_scan, &map_from_body, pose->covariance);
  add_growth(&view->odometry.growth, &map_from_scan, &map_from_body, duration_s, pose->covariance);
  set_map(view, pose);
  return result == ALCES_OK ? with_limit(view, correction->stamp_ns, ALCES_PAGE_SCAN_LIMIT_NS) : result;
}

static int latest_in_map(const struct view* view, alces_pose* pose) {
  const struct alces_page_map* const map = &view->map;
  if (map->map_from_body.sequence == 0) return ALCES_NOT_YET;
  const int is_carried =
      map->map_from_odom.sequence != 0 && view->odometry.odom_from_body.sequence != 0 &&
      (view->odometry.is_valid || view->odometry.odom_from_body.stamp_ns >= map->map_from_body.stamp_ns);
  if (!is_carried) return scan_pose(view, pose);
  return into_map(view, latest_odometry(view, pose), pose);
}

int alces_client_latest(alces_client* client, alces_transform transform, alces_pose* pose) {
  if (client == NULL || pose == NULL) return ALCES_BAD_ARGUMENT;
  struct view view;
  const int result = transform == ALCES_ODOM_FROM_BODY ? look(client, &view) : look_with_map(client, &view);
  if (result < 0) return result;
  switch (transform) {
    case ALCES_ODOM_FROM_BODY:
      return latest_odometry(&view, pose);
    case ALCES_MAP_FROM_ODOM:
      return latest_correction(&view, pose);
    case ALCES_MAP_FROM_BODY:
      return latest_in_map(&view, pose);
    default:
      return ALCES_BAD_ARGUMENT;
  }
}

int alces_client_pose_at(alces_client* client, alces_transform transform, int64_t stamp_ns,
                         alces_pose* pose) {
  if (client == NULL || pose == NULL) return ALCES_BAD_ARGUMENT;
  if (transform == ALCES_MAP_FROM_ODOM) return alces_client_latest(client, transform, pose);
  if (transform != ALCES_ODOM_FROM_BODY && transform != ALCES_MAP_FROM_BODY) return ALCES_BAD_ARGUMENT;
  struct view view;
  int result = transform == ALCES_ODOM_FROM_BODY ? look(client, &view) : look_with_map(client, &view);
  if (result < 0) return result;
  if (transform == ALCES_MAP_FROM_BODY && view.map.map_from_odom.sequence == 0) return ALCES_NOT_YET;
  result = odometry_at(&view, stamp_ns, pose);
  return result < 0 || transform == ALCES_ODOM_FROM_BODY ? result : into_map(&view, result, pose);
}

static void copy_words(char* to, size_t room, const char* from, size_t size) {
  const size_t count = size < room ? size : room;
  memcpy(to, from, count);
  to[count - 1] = '\0';
}

int alces_client_status(alces_client* client, alces_status* status) {
  if (client == NULL || status == NULL) return ALCES_BAD_ARGUMENT;
  struct view view;
  const int result = look(client, &view);
  if (result < 0) return result;
  struct alces_page_status said;
  if (!read_status(view.page, &said)) return ALCES_UNSETTLED;
  if (said.updated_ns == 0) return ALCES_NOT_YET;
  memset(status, 0, sizeof *status);
  status->start_id = view.page->head.start_id;
  status->start_ns = view.page->head.start_ns;
  status->pid = (int32_t)view.page->head.pid;
  status->alive_age_ns = view.now_ns - view.odometry.alive_ns;
  status->scans = said.scans;
  status->scans_mapped = said.scans_mapped;
  status->scans_dropped = said.scans_dropped;
  status->loops_closed = said.loops_closed;
  status->loops_refused = said.loops_refused;
  status->latency_median_ns = said.latency_median_ns;
  status->latency_worst_ns = said.latency_worst_ns;
  status->mapper_hung_ns = said.mapper_hung_ns;
  status->scans_per_s = said.scans_per_s;
  status->map_verdict = (int32_t)said.verdict;
  status->map_parts = (int32_t)said.parts;
  status->is_odometry_valid = view.odometry.is_valid != 0;
  status->is_scanning = said.is_scanning != 0;
  status->is_mapping = said.is_mapping != 0;
  status->is_map_full = said.is_map_full != 0;
  status->is_archive_stalled = said.is_archive_stalled != 0;
  status->is_recording = said.is_recording != 0;
  status->is_recording_stalled = said.is_recording_stalled != 0;
  copy_words(status->phase, sizeof status->phase, said.phase, sizeof said.phase);
  copy_words(status->reason, sizeof status->reason, said.reason, sizeof said.reason);
  copy_words(status->doubt, sizeof status->doubt, said.doubt, sizeof said.doubt);
  return view.result;
}

static int hand_on(const struct alces_page_event* said, uint64_t start_id, alces_event* event) {
  memset(event, 0, sizeof *event);
  event->start_id = start_id;
  event->sequence = said->sequence;
  event->stamp_ns = said->stamp_ns;
  event->published_ns = said->published_ns;
  event->distance_m = said->distance_m;
  event->correction_m = said->correction_m;
  event->correction_rad = said->correction_rad;
  event->is_closed = said->is_closed != 0;
  event->first_scan = said->first_scan;
  event->last_scan = said->last_scan;
  copy_words(event->verdict, sizeof event->verdict, said->verdict, sizeof said->verdict);
  return ALCES_OK;
}

static uint64_t oldest_event(uint64_t newest) {
  return newest > ALCES_PAGE_EVENTS ? newest - ALCES_PAGE_EVENTS + 1 : 1;
}

int alces_client_next_event(alces_client* client, alces_event* event) {
  if (client == NULL || event == NULL) return ALCES_BAD_ARGUMENT;
  struct view view;
  const int result = look_with_map(client, &view);
  if (result < 0) return result;
  const uint64_t start_id = view.page->head.start_id;
  if (client->events_start_id != start_id) {
    const int is_restart = client->events_start_id != 0;
    client->events_start_id = start_id;
    client->next_event = oldest_event(view.map.events);
    if (is_restart) return ALCES_RESTARTED;
  }
  if (client->next_event > view.map.events) return ALCES_NO_EVENT;
  struct alces_page_event said;
  int got = client->next_event < oldest_event(view.map.events)
                ? ALCES_EVENTS_LOST
                : read_event(view.page, client->next_event, &said);
  if (got == ALCES_EVENTS_LOST) client->next_event = oldest_event(view.map.events + 1);
  if (got != ALCES_OK) return got;
  ++client->next_event;
  return hand_on(&said, start_id, event);
}
