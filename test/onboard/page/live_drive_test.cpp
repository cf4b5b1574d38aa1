// A drive whose poses other processes read while it goes on: wires, drivers, assembler and mapper as on the
// vehicle, in simulated time; readers through libalces-client.
#include <sys/mman.h>
#include <sys/wait.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <functional>
#include <new>

#include "alces_onboard/page/page_file.h"
#include "client/page_in_file.h"
#include "onboard/vehicle_bench.h"

using namespace alces;
using namespace alces::onboard;
using alces::test::ClientAt;
using alces::test::PageFolder;

namespace {

Pose pose_of(const alces_pose& pose) {
  const double* const q = pose.orientation_xyzw;
  return {Eigen::Quaterniond(q[3], q[0], q[1], q[2]),
          {pose.position_m[0], pose.position_m[1], pose.position_m[2]}};
}

/// Squared error over its covariance, a degree of freedom.
double normalised(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
  return error.dot(covariance.inverse() * error) / 3;
}

class SimulatedClock final : public StageClock {
 public:
  explicit SimulatedClock(const sim::SimulatedRig& rig) : rig_(rig) {}
  [[nodiscard]] std::uint64_t now_ns() override { return static_cast<std::uint64_t>(rig_.now_ns()); }

 private:
  const sim::SimulatedRig& rig_;
};

/// A simulated vehicle with a page.
class LiveBench {
 public:
  explicit LiveBench(std::uint64_t seed, std::size_t scans = 90)
      : vehicle_(simulation(seed, scans)),
        clock_(vehicle_.rig()),
        file_({.path = folder_.file(), .group = {}}),
        page_(file_.page()),
        pipeline_(configuration(),
                  {.ports = {&rig().can_port(),
                             {&rig().byte_port(laser_a_channel), &rig().byte_port(laser_b_channel)}},
                   .page = &page_,
                   .clock = &clock_}) {
    pipeline_.start_scanner();
  }
  [[nodiscard]] sim::SimulatedRig& rig() { return vehicle_.rig(); }
  [[nodiscard]] Pipeline& pipeline() { return pipeline_; }
  [[nodiscard]] std::string path() const { return folder_.file(); }
  void end() { file_.end(); }
  void drive(EventSink& sink) { rig().advance_to(rig().motion().stop_stamp_ns() + ns_per_s, sink); }

 private:
  static sim::SimulatedScannerSettings simulation(std::uint64_t seed, std::size_t scans) {
    sim::SimulatedScannerSettings settings;
    settings.rig.seed = settings.rig.motion.seed = seed;
    settings.rig.motion.scans = scans;
    return settings;
  }
  static PipelineConfig configuration() {
    settings::VehicleSettings vehicle = settings::default_vehicle_settings();
    vehicle.mapper.scan_capacity = 192;
    vehicle.mapper.pool_bytes = std::size_t{32} << 20;
    PipelineConfig config = config_of(vehicle);
    config.recording.configuration = {};
    config.records = false;
    return config;
  }

  PageFolder folder_;
  sim::SimulatedScanner vehicle_;
  SimulatedClock clock_;
  PageFile file_;
  LivePage page_;
  Pipeline pipeline_;
};

/// What a reader saw; in memory that it shares with the test.
struct Seen {
  std::atomic<std::uint64_t> reads{0};
  std::uint64_t refused = 0;
  std::uint64_t first_sequence = 0;
  std::uint64_t last_sequence = 0;
  std::int64_t first_stamp_ns = 0;
  std::int64_t last_stamp_ns = 0;
  std::uint64_t backward = 0;
  double worst_jump_m = 0;  ///< beyond what the speed explains
  double worst_turn_rad = 0;
  std::uint64_t corrections = 0;
  std::uint64_t loops = 0;
  int last_result = 0;
};
struct Shared {
  std::atomic<std::int64_t> now_ns{0};
  std::atomic<bool> is_over{false};
  std::array<Seen, 3> readers;
};

/// Consecutive poses lie as far apart as the wheels' speed says.
void compare(const alces_pose& before, const alces_pose& now, double duration_s, Seen& seen) {
  const Pose step = pose_of(before).inverse() * pose_of(now);
  const double fastest = std::max(std::abs(now.velocity[0]), std::abs(before.velocity[0]));
  const double quickest = std::max(std::abs(now.velocity[5]), std::abs(before.velocity[5]));
  seen.worst_jump_m = std::max(seen.worst_jump_m, step.translation_m.norm() - fastest * duration_s);
  seen.worst_turn_rad =
      std::max(seen.worst_turn_rad, angle_between_rad({1, 0, 0, 0}, step.rotation) - quickest * duration_s);
}

void look(ClientAt& client, const Shared& shared, Seen& seen) {
  const alces_pose before = client.pose;
  const int result = client.latest(ALCES_ODOM_FROM_BODY);
  seen.last_result = result;
  ++seen.reads;
  if (result != ALCES_OK) {
    // Simulated time runs so fast that a reader which is held up for a moment asks at a time long past.
    const bool was_held_up = shared.now_ns.load() - client.now_ns > 200 * ns_per_ms;
    const bool is_expected = result == ALCES_NOT_YET || result == ALCES_NO_PAGE || result == ALCES_ENDED;
    seen.refused += is_expected || was_held_up ? 0U : 1U;
    return;
  }
  const alces_pose& now = client.pose;
  if (seen.first_sequence == 0) {
    seen.first_sequence = now.sequence;
    seen.first_stamp_ns = now.stamp_ns;
  } else {
    const double duration_s = seconds(now.stamp_ns - before.stamp_ns);
    seen.backward += duration_s < 0 || now.sequence < before.sequence ? 1U : 0U;
    if (duration_s < 0.1) compare(before, now, duration_s, seen);  // longer ago: the speed was another
  }
  seen.last_sequence = now.sequence;
  seen.last_stamp_ns = now.stamp_ns;
}

[[noreturn]] void read_all_the_time(Shared& shared, std::size_t number, const std::string& path) {
  ClientAt client(path);
  ClientAt corrected(path);
  Seen& seen = shared.readers[number];
  std::uint64_t map_sequence = 0;
  while (!shared.is_over.load()) {
    client.now_ns = corrected.now_ns = shared.now_ns.load();
    look(client, shared, seen);
    if (corrected.latest(ALCES_MAP_FROM_ODOM) >= 0 && corrected.pose.sequence != map_sequence) {
      map_sequence = corrected.pose.sequence;
      ++seen.corrections;
    }
    if (corrected.next_event() == ALCES_OK) ++seen.loops;
  }
  client.now_ns = shared.now_ns.load();
  look(client, shared, seen);
  ::_exit(0);
}

/// Processes that read as fast as they can.
class Readers {
 public:
  explicit Readers(const std::string& path) {
    void* const memory =
        ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    REQUIRE(memory != MAP_FAILED);
    shared_ = new (memory) Shared;
    for (std::size_t i = 0; i < children_.size(); ++i) {
      children_[i] = ::fork();
      REQUIRE(children_[i] >= 0);
      if (children_[i] == 0) read_all_the_time(*shared_, i, path);
    }
  }
  Readers(const Readers&) = delete;
  Readers& operator=(const Readers&) = delete;
  ~Readers() {
    for (const pid_t child : children_) {
      ::kill(child, SIGKILL);
      ::waitpid(child, nullptr, 0);
    }
    ::munmap(shared_, sizeof(Shared));
  }
  [[nodiscard]] Shared& shared() { return *shared_; }
  [[nodiscard]] const Seen& seen(std::size_t number) const { return shared_->readers[number]; }
  void send(std::size_t number, int signal) const { ::kill(children_[number], signal); }
  void end(std::size_t number) {
    ::waitpid(children_[number], nullptr, 0);
    children_[number] = ::fork();  // that the destructor may kill and wait
    if (children_[number] == 0) ::_exit(0);
  }

 private:
  std::array<pid_t, 3> children_{};
  Shared* shared_ = nullptr;
};

/// How map -> odom moves: by what a loop is said to move it.
struct Corrections {
  std::uint64_t sequence = 0;
  Pose map_from_odom;
  double largest_step_m = 0;  ///< of the body, without a loop
  double largest_loop_m = 0;
};

}  // namespace

TEST_CASE("other processes read a drive's poses while it goes on: smooth, fast, corrected at loops") {
  LiveBench bench(2);
  Readers readers(bench.path());
  ClientAt client(bench.path());
  ClientAt events(bench.path());
  Corrections corrections;
  ClientAt odometry(bench.path());
  Seen every;
  double loop_m = 0;
  const std::int64_t middle_ns =
      (bench.rig().motion().start_stamp_ns() + bench.rig().motion().stop_stamp_ns()) / 2;

  class Watch final : public EventSink {
   public:
    explicit Watch(std::function<void(const Event&)> work) : work_(std::move(work)) {}
    void on_event(const Event& event) override { work_(event); }

   private:
    std::function<void(const Event&)> work_;
  };
  bool was_disturbed = false;
  Watch watch([&](const Event& event) {
    bench.pipeline().on_event(event);
    while (bench.pipeline().run_mapper_once()) {
    }
    client.now_ns = events.now_ns = odometry.now_ns = bench.rig().now_ns();
    readers.shared().now_ns = client.now_ns;
    look(odometry, readers.shared(), every);
    if (!was_disturbed && client.now_ns > middle_ns) {
      was_disturbed = true;
      readers.send(1, SIGSTOP);
      readers.send(2, SIGKILL);
    }
    bool is_loop = false;
    while (events.next_event() == ALCES_OK) {
      is_loop = true;
      loop_m = std::max(loop_m, events.event.correction_m);
    }
    if (client.latest(ALCES_MAP_FROM_ODOM) < 0 || client.pose.sequence == corrections.sequence) return;
    const bool is_first = corrections.sequence == 0;
    corrections.sequence = client.pose.sequence;
    const Pose map_from_odom = pose_of(client.pose);
    const std::int64_t stamp_ns = client.pose.map_stamp_ns;
    REQUIRE(client.at(ALCES_ODOM_FROM_BODY, stamp_ns) == ALCES_OK);
    const Pose odom_from_body = pose_of(client.pose);
    const double moved_m = ((map_from_odom * odom_from_body).translation_m -
                            (corrections.map_from_odom * odom_from_body).translation_m)
                               .norm();
    if (!is_first) {
      double& largest = is_loop ? corrections.largest_loop_m : corrections.largest_step_m;
      largest = std::max(largest, moved_m);
    }
    corrections.map_from_odom = map_from_odom;
  });
  bench.drive(watch);
  const std::uint64_t loops = bench.pipeline().counters().loops_closed;
  const std::uint64_t mapped = bench.pipeline().counters().scans_mapped;
  REQUIRE(loops >= 2);
  CHECK(mapped > 85);

  // A loop of 20 cm.
  CAPTURE(loop_m, corrections.largest_loop_m, corrections.largest_step_m);
  CHECK(loop_m > 0.1);
  CHECK(corrections.largest_loop_m > 0.5 * loop_m);
  CHECK(corrections.largest_step_m < 0.1);

  // All that was published.
  CAPTURE(every.worst_jump_m, every.worst_turn_rad);
  CHECK(every.refused == 0);
  CHECK(every.backward == 0);
  CHECK(every.worst_jump_m < 0.001);
  CHECK(every.worst_turn_rad < 0.001);

  // The reader that went on.
  readers.shared().is_over = true;
  readers.end(0);
  const Seen& seen = readers.seen(0);
  CAPTURE(seen.worst_jump_m, seen.worst_turn_rad, seen.reads.load());
  CHECK(seen.refused == 0);
  CHECK(seen.backward == 0);
  CHECK(seen.worst_jump_m < 0.003);
  CHECK(seen.worst_turn_rad < 0.003);
  const double driven_s = seconds(seen.last_stamp_ns - seen.first_stamp_ns);
  CHECK(driven_s > 100);
  CHECK(static_cast<double>(seen.last_sequence - seen.first_sequence) / driven_s > 50);
  CHECK(seen.corrections > 20);
  CHECK(seen.corrections <= mapped);
  CHECK(seen.loops == loops + bench.pipeline().counters().loops_refused);

  // The one that was stopped in the middle held nobody up, and reads on.
  const std::uint64_t reads = readers.seen(1).reads;
  bench.end();
  readers.send(1, SIGCONT);
  readers.end(1);
  CHECK(readers.seen(1).reads > reads);
  CHECK(readers.seen(1).last_result == ALCES_ENDED);
  CHECK(readers.seen(1).refused == 0);
}

TEST_CASE("covariances of odom -> body and of the map's poses tell how far off they are") {
  double odometry_place = 0;
  double odometry_turn = 0;
  double map_place = 0;
  double map_turn = 0;
  double worst = 0;
  std::size_t odometry_count = 0;
  std::size_t map_count = 0;
  for (const std::uint64_t seed : {1U, 3U, 5U}) {
    LiveBench bench(seed, 70);
    ClientAt client(bench.path());
    std::int64_t odom_begin_ns = 0;
    std::int64_t map_begin_ns = 0;
    std::uint64_t map_sequence = 0;
    std::int64_t looked_ns = 0;
    const auto compare = [&](std::int64_t begin_ns, double& place, double& turn) {
      const Pose truth = bench.rig().map_from_body(client.pose.stamp_ns, begin_ns);
      const Pose said = pose_of(client.pose);
      const Matrix6d covariance = Eigen::Map<const Matrix6d>(client.pose.covariance);
      const double off =
          normalised(said.translation_m - truth.translation_m, covariance.topLeftCorner<3, 3>());
      place += off;
      turn += normalised(log_so3(said.rotation * truth.rotation.conjugate()),
                         covariance.bottomRightCorner<3, 3>());
      worst = std::max(worst, off);
    };
    Feeder feeder(bench.pipeline());
    const std::int64_t end_ns = bench.rig().motion().stop_stamp_ns();
    for (std::int64_t now_ns = bench.rig().motion().start_stamp_ns(); now_ns < end_ns;
         now_ns += 100 * ns_per_ms) {
      bench.rig().advance_to(now_ns, feeder);
      client.now_ns = now_ns;
      const bool drives = bench.rig().motion().way_m(now_ns) > 1;
      if (client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK) {
        if (odom_begin_ns == 0) odom_begin_ns = client.pose.stamp_ns;
        if (drives && now_ns - looked_ns >= 5 * ns_per_s) {
          looked_ns = now_ns;
          compare(odom_begin_ns, odometry_place, odometry_turn);
          ++odometry_count;
        }
      }
      if (client.latest(ALCES_MAP_FROM_ODOM) != ALCES_OK || client.pose.sequence == map_sequence) continue;
      map_sequence = client.pose.sequence;
      const std::int64_t stamp_ns = client.pose.map_stamp_ns;
      if (map_begin_ns == 0) map_begin_ns = stamp_ns;
      if (!drives || client.at(ALCES_MAP_FROM_BODY, stamp_ns) != ALCES_OK) continue;
      compare(map_begin_ns, map_place, map_turn);
      ++map_count;
    }
  }
  REQUIRE(odometry_count > 30);
  REQUIRE(map_count > 150);
  odometry_place /= static_cast<double>(odometry_count);
  odometry_turn /= static_cast<double>(odometry_count);
  map_place /= static_cast<double>(map_count);
  map_turn /= static_cast<double>(map_count);
  WARN("normalised errors: odom -> body " << odometry_place << ", turn " << odometry_turn << "; map "
                                          << map_place << ", turn " << map_turn << "; worst " << worst);
  CHECK(odometry_place > 0.2);
  CHECK(odometry_place < 2);
  CHECK(odometry_turn > 0.2);
  CHECK(odometry_turn < 2);
  // The map's edges are labelled less sure than they are on simulated drives (EdgeUncertainty::inflation).
  CHECK(map_place > 0.03);
  CHECK(map_place < 1.5);
  CHECK(map_turn > 0.02);
  CHECK(map_turn < 1.5);
  CHECK(worst < 12);
}

TEST_CASE("a drive with a page is mapped to the bit as without") {
  const RecordedDrive& drive = recorded_drive();
  const PageFolder folder;
  PageFile file({.path = folder.file(), .group = {}});
  LivePage page(file.page());
  NoWires wires;
  PipelineConfig config = config_of(small_vehicle());
  config.records = false;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .page = &page});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  REQUIRE(end_drive(pipeline));
  CHECK(are_same_bits(poses_of(pipeline), drive.poses));
  ClientAt client(folder.file());
  client.now_ns = drive.recorded.events.back().event.stamp_ns;
  REQUIRE(client.latest(ALCES_MAP_FROM_BODY) >= 0);
  CHECK(client.pose.map_sequence == drive.counters.scans_mapped);
  REQUIRE(client.status() >= 0);
  CHECK(client.said.scans_mapped > 0);
  CHECK(std::string(client.said.phase) != "");
  CHECK(client.said.map_verdict == 0);
}

TEST_CASE("how late poses are is measured from the scan's last ray, and told") {
  LiveBench bench(1, 8);
  Feeder feeder(bench.pipeline());
  bench.drive(feeder);
  const StatusReport report = bench.pipeline().status();
  // The map takes no simulated time: what is left is the wait for odometry and angle (settle_ms).
  CHECK(report.latency_median_ns >= 40 * ns_per_ms);
  CHECK(report.latency_median_ns < 150 * ns_per_ms);
  CHECK(report.latency_worst_ns >= report.latency_median_ns);
  std::array<char, 512> room{};
  CHECK(std::string(format(report, room)).find(" s late, worst 0.") != std::string::npos);
  ClientAt client(bench.path());
  client.now_ns = bench.rig().now_ns();
  REQUIRE(client.status() == ALCES_OK);
  CHECK(client.said.latency_median_ns == report.latency_median_ns);
}
