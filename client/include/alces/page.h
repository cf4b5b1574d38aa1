// The page: what alcesd shares of itself while it runs, in a file on tmpfs that others map read-only.
//
// Programs include client.h. This is the layout that writer and readers agree on, for those who read the page
// without libalces-client. Numbers are the machine's own (little endian on all that Alces runs on), lengths
// in m, angles in rad, stamps in ns of CLOCK_MONOTONIC, frames those of ROS REP 103 and 105.
//
//   head       constant once the page has its name, but for `state`
//   odometry   odom -> body, at least 50 times a second     written by the acquisition thread
//   status     how alcesd is, ten times a second            written by the acquisition thread
//   map        map -> odom, after each scan and loop        written by the mapping thread
//   nodes      the last 1024 poses of the odometry          written by the acquisition thread
//   events     the last 64 loops                            written by the mapping thread
//
// A copy is a generation word and a payload, a seqlock: its one writer makes the generation odd, stores the
// payload, makes it even; a reader believes what it copied if the generation was even before and is the same
// after. All accesses are atomic, 32 bits at a time: nothing tears that is not seen, on any processor.
//
// A section has two copies and a word that says which of them is the newest; the other one is written. So a
// writer that is held up, or dies, in the middle leaves the copy before it whole, and nobody waits for
// anybody: a reader tries again only when it was overtaken. A ring's entry is one copy: the one that is
// written is the oldest, or not announced yet.
//
// A ring's entry of sequence s (from 1) lies at place (s - 1) % length; a newer one takes it over.
//
// alcesd makes a new file at each start and renames it into place, then marks the page before as replaced: so
// a page is whole from its first byte on, and a reader of the old one sees that there is a new one.
#ifndef ALCES_PAGE_H
#define ALCES_PAGE_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ALCES_PAGE_DEFAULT_PATH "/run/alces/page"
#define ALCES_PAGE_MAGIC "ALCESPG"  // with its end: 8 bytes
#define ALCES_PAGE_VERSION 1u       // another one: another layout
#define ALCES_PAGE_NODES 1024u
#define ALCES_PAGE_EVENTS 64u
#define ALCES_PAGE_TRIES 1000u

// Beyond these a pose is stale.
#define ALCES_PAGE_ALIVE_LIMIT_NS INT64_C(500000000)  // since the acquisition thread wrote: it stands still
#define ALCES_PAGE_SCAN_LIMIT_NS INT64_C(3000000000)  // since the newest scan that is in the map
#define ALCES_PAGE_AHEAD_LIMIT_NS INT64_C(100000000)  // past the newest pose of the odometry

enum { ALCES_PAGE_LIVE = 1, ALCES_PAGE_ENDED = 2, ALCES_PAGE_REPLACED = 3 };

struct alces_page_head {
  char magic[8];
  uint64_t start_id;  // of this start of alcesd; never 0
  int64_t start_ns;
  uint32_t version;
  uint32_t size;   // of the page, bytes
  uint32_t state;  // atomic
  uint32_t pid;
  uint32_t reserved[6];
};

struct alces_page_rigid {
  double position_m[3];
  double orientation_xyzw[4];
};

// A transform as it is published. Covariance: row by row, of x, y, z, and the rotation about x, y, z, along
// the axes of the parent frame, at the body.
struct alces_page_transform {
  uint64_t sequence;  // counts publications from 1; 0: none yet
  int64_t stamp_ns;   // of what it holds at
  int64_t published_ns;
  struct alces_page_rigid parent_from_child;
  double covariance[36];
};

// What odometry adds to an uncertainty: standard deviations.
struct alces_page_growth {
  double way;                     // share of the way
  double turn;                    // share of the turn
  double heading_rad_per_s;       // a rate's bias
  double heading_rad_per_sqrt_s;  // a rate's noise
  double tilt_rad;                // of the ground, where roll and pitch are not measured
};

struct alces_page_odometry {
  int64_t alive_ns;  // the acquisition thread wrote this
  uint64_t nodes;    // sequence of the newest
  int64_t node_stamp_ns;
  struct alces_page_transform odom_from_body;  // that node, carried on to when it was published
  double velocity[6];                          // of the body along its own axes: m/s, rad/s
  struct alces_page_growth growth;
  uint32_t is_valid;  // odometry comes and is believed
  uint32_t reserved;
};

struct alces_page_map {
  uint64_t events;                            // sequence of the newest
  struct alces_page_transform map_from_odom;  // stamp: reference time of the scan it was found by
  struct alces_page_rigid odom_from_body;     // at that time
  struct alces_page_transform map_from_body;  // of the newest scan, at its reference time
};

struct alces_page_node {
  uint64_t sequence;
  int64_t stamp_ns;
  struct alces_page_rigid odom_from_body;
  uint32_t is_connected;  // the way from the node before is known
  uint32_t reserved;
};

struct alces_page_event {
  uint64_t sequence;
  int64_t stamp_ns;  // reference time of the scan that closed the loop, or would have
  int64_t published_ns;
  double distance_m;      // between the two places before, in the map
  double correction_m;    // how far the newer scan moved
  double correction_rad;  // and turned
  uint32_t is_closed;     // 0: refused
  uint32_t first_scan;
  uint32_t last_scan;
  uint32_t reserved;
  char verdict[64];  // a word for people
};

struct alces_page_status {
  int64_t updated_ns;
  uint64_t scans;  // assembled
  uint64_t scans_mapped;
  uint64_t scans_dropped;
  uint64_t loops_closed;
  uint64_t loops_refused;
  int64_t latency_median_ns;  // from a scan's last ray to its pose here; of the last 64 scans; 0: none yet
  int64_t latency_worst_ns;   // since the start
  int64_t mapper_hung_ns;     // the mapper has not come back for so long
  double scans_per_s;
  uint32_t verdict;  // of the map: 0 good, 1 doubtful, 2 bad
  uint32_t is_scanning;
  uint32_t is_mapping;
  uint32_t is_map_full;
  uint32_t is_archive_stalled;
  uint32_t is_recording;
  uint32_t is_recording_stalled;
  uint32_t parts;  // of the map that nothing ties together
  char phase[64];  // words for people
  char reason[128];
  char doubt[128];
};

// Words, filled up to 64 bytes.
#define ALCES_PAGE_WORDS(payload) (sizeof(payload) / 4)
#define ALCES_PAGE_ENTRY(payload) ((4 + sizeof(payload) + 63) / 64 * 16)
#define ALCES_PAGE_SECTION(payload) (16 + 2 * ALCES_PAGE_ENTRY(payload))

struct alces_page {
  struct alces_page_head head;
  uint32_t odometry[ALCES_PAGE_SECTION(struct alces_page_odometry)];
  uint32_t status[ALCES_PAGE_SECTION(struct alces_page_status)];
  uint32_t map[ALCES_PAGE_SECTION(struct alces_page_map)];
  uint32_t nodes[ALCES_PAGE_NODES][ALCES_PAGE_ENTRY(struct alces_page_node)];
  uint32_t events[ALCES_PAGE_EVENTS][ALCES_PAGE_ENTRY(struct alces_page_event)];
};

// The same on 32 and 64 bits.
static_assert(sizeof(struct alces_page_head) == 64, "layout");
static_assert(sizeof(struct alces_page_transform) == 368, "layout");
static_assert(sizeof(struct alces_page_odometry) == 488, "layout");
static_assert(sizeof(struct alces_page_status) == 432, "layout");
static_assert(sizeof(struct alces_page_map) == 800, "layout");
static_assert(sizeof(struct alces_page_node) == 80, "layout");
static_assert(sizeof(struct alces_page_event) == 128, "layout");
static_assert(offsetof(struct alces_page, nodes) == 64 + 3 * 64 + 2 * (512 + 448 + 832), "layout");
static_assert(sizeof(struct alces_page) == 256 + 2 * (512 + 448 + 832) + 1024 * 128 + 64 * 192, "layout");

// The copy's one writer: `count` words of payload.
static inline void alces_page_store(uint32_t* copy, const uint32_t* payload, size_t count) {
  const uint32_t generation = __atomic_load_n(copy, __ATOMIC_RELAXED);
  __atomic_store_n(copy, generation + 1, __ATOMIC_RELAXED);
  __atomic_thread_fence(__ATOMIC_RELEASE);  // whoever sees a word of this payload sees the odd generation
  for (size_t i = 0; i < count; ++i) __atomic_store_n(copy + 1 + i, payload[i], __ATOMIC_RELAXED);
  __atomic_store_n(copy, generation + 2, __ATOMIC_RELEASE);
}

// 1: the payload as one write left it. 0: it is being written.
static inline int alces_page_load(const uint32_t* copy, uint32_t* payload, size_t count) {
  const uint32_t generation = __atomic_load_n(copy, __ATOMIC_ACQUIRE);
  if (generation % 2 != 0) return 0;
  for (size_t i = 0; i < count; ++i) payload[i] = __atomic_load_n(copy + 1 + i, __ATOMIC_RELAXED);
  __atomic_thread_fence(__ATOMIC_ACQUIRE);  // before the second look at the generation
  return __atomic_load_n(copy, __ATOMIC_RELAXED) == generation;
}

// Where a section's copy lies, `which` being 0 or 1.
static inline size_t alces_page_copy(uint32_t which, size_t count) {
  return 16 + which * ((1 + count + 15) / 16 * 16);
}

// The section's one writer.
static inline void alces_page_write(uint32_t* section, const uint32_t* payload, size_t count) {
  const uint32_t other = 1 - __atomic_load_n(section, __ATOMIC_RELAXED) % 2;
  alces_page_store(section + alces_page_copy(other, count), payload, count);
  __atomic_store_n(section, other, __ATOMIC_RELEASE);
}

// The newest payload. 0: the reader was overtaken again and again, or this is no page any more.
static inline int alces_page_read(const uint32_t* section, uint32_t* payload, size_t count) {
  for (unsigned attempt = 0; attempt < ALCES_PAGE_TRIES; ++attempt) {
    const uint32_t newest = __atomic_load_n(section, __ATOMIC_ACQUIRE) % 2;
    if (alces_page_load(section + alces_page_copy(newest, count), payload, count)) return 1;
  }
  return 0;
}

#ifdef __cplusplus
}
#endif

#endif
