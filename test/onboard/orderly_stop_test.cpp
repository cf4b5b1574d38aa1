#include "alces_onboard/orderly_stop.h"

#include <catch2/catch.hpp>

#include "onboard/vehicle_bench.h"

using namespace alces;
using namespace alces::onboard;

namespace {

struct StopBench {
  explicit StopBench(bool maps = true)
      : pipeline(config_of(small_vehicle()),
                 {.ports = bench.ports(), .recording = &sink, .listener = &notices}),
        feeder(pipeline) {
    feeder.maps = maps;
    pipeline.start_scanner();
    bench.drive_to_end(feeder);
  }
  /// Rounds of 10 ms until it is finished, at most so long; how long it took.
  std::int64_t run(OrderlyStop& stop, std::uint64_t requests, std::int64_t limit_ns, bool maps) {
    const std::int64_t begin_ns = bench.now_ns();
    while (bench.now_ns() - begin_ns < limit_ns) {
      bench.run_for(10 * ns_per_ms, feeder);
      if (maps) {
        while (pipeline.run_mapper_once()) {
        }
      }
      if (stop.update(bench.now_ns(), requests, true) == StopStage::finished) break;
    }
    return bench.now_ns() - begin_ns;
  }
  VehicleBench bench{4};
  MemorySink sink;
  NoticeList notices;
  Pipeline pipeline;
  Feeder feeder;
};

}  // namespace

TEST_CASE("told to stop, the lasers and the motor stop, the map is finished and the recording is whole") {
  StopBench bench;
  OrderlyStop stop(bench.pipeline, {});
  CHECK(stop.update(bench.bench.now_ns(), 0, true) == StopStage::running);
  REQUIRE(bench.pipeline.scanner().phase() == ScannerPhase::scanning);
  const std::int64_t took_ns = bench.run(stop, 1, 60 * ns_per_s, true);
  REQUIRE(stop.stage() == StopStage::finished);
  CHECK(took_ns < 20 * ns_per_s);
  CHECK_FALSE(stop.was_scanner_left());
  CHECK(bench.pipeline.has_scanner_ended());
  CHECK(bench.pipeline.scanner().motor().state() == MotorState::stopped);
  CHECK(stop.is_motor_confirmed());
  CHECK(bench.bench.vehicle().drive().head_turns_per_s_at(bench.bench.now_ns()) == 0);
  CHECK(bench.pipeline.finish_recording());
  const Recorded recorded = read_back(bench.sink.bytes);
  CHECK(recorded.is_whole);
  CHECK(recorded.scans.size() == bench.pipeline.counters().scans);
  CHECK(bench.pipeline.counters().scans_left == 0);
}

TEST_CASE("a drive that was stopped in order replays to the same poses") {
  StopBench bench;
  OrderlyStop stop(bench.pipeline, {});
  bench.run(stop, 1, 60 * ns_per_s, true);
  REQUIRE(bench.pipeline.finish_recording());
  const Recorded recorded = read_back(bench.sink.bytes);
  NoWires wires;
  PipelineConfig config = config_of(small_vehicle());
  config.records = false;
  Pipeline replay(config, {.ports = {&wires, {&wires, &wires}}});
  replay.start_scanner();
  Feeder feeder(replay);
  feed(recorded.events, feeder);
  REQUIRE(end_drive(replay));
  CHECK(replay.counters().scans_mapped >= 3);
  CHECK(are_same_bits(poses_of(replay), poses_of(bench.pipeline)));
}

TEST_CASE("a second request leaves the scans that wait") {
  StopBench bench(false);
  REQUIRE(bench.pipeline.status().waiting_scans == 3);
  OrderlyStop stop(bench.pipeline, {});
  CHECK(stop.update(bench.bench.now_ns(), 2, true) == StopStage::stopping_scanner);
  bench.run(stop, 2, 60 * ns_per_s, true);
  REQUIRE(stop.stage() == StopStage::finished);
  CHECK(bench.pipeline.counters().scans_mapped == 0);
  CHECK(bench.pipeline.counters().scans_left >= 3);
  CHECK(bench.pipeline.finish_recording());
}

TEST_CASE("a third request, or a scanner that does not stop, is waited for no longer") {
  StopBench bench;
  bool stop_was_confirmed = true;
  SECTION("the third request") {
    OrderlyStop stop(bench.pipeline, {});
    CHECK(bench.run(stop, 3, ns_per_s, true) < 100 * ns_per_ms);
    CHECK(stop.stage() == StopStage::finished);
    CHECK(stop.was_scanner_left());
    stop_was_confirmed = stop.is_motor_confirmed();
  }
  SECTION("the limit") {
    OrderlyStop stop(bench.pipeline, {.scanner_limit_ns = 50 * ns_per_ms});
    CHECK(bench.run(stop, 1, ns_per_s, true) < 200 * ns_per_ms);
    CHECK(stop.stage() == StopStage::finished);
    CHECK(stop.was_scanner_left());
    stop_was_confirmed = stop.is_motor_confirmed();
  }
  CHECK(bench.notices.has("did not stop in time"));
  CHECK_FALSE(stop_was_confirmed);
  CHECK(bench.notices.has("the drive did not confirm that the motor stands without torque"));
  CHECK(bench.pipeline.finish_recording());
  CHECK(read_back(bench.sink.bytes).is_whole);
}

TEST_CASE("a mapper that is not done in time is told to leave the rest") {
  StopBench bench(false);
  OrderlyStop stop(bench.pipeline, {.mapping_limit_ns = 100 * ns_per_ms, .leave_limit_ns = 60 * ns_per_s});
  bench.feeder.maps = false;
  bench.run(stop, 1, 30 * ns_per_s, false);
  REQUIRE(stop.stage() == StopStage::finishing_map);
  bench.run(stop, 1, ns_per_s, true);
  CHECK(stop.stage() == StopStage::finished);
  CHECK(bench.pipeline.counters().scans_left >= 3);
}

TEST_CASE("a second request stops the head by quick stop, without waiting for lasers") {
  StopBench bench;
  OrderlyStop stop(bench.pipeline, {});
  REQUIRE(bench.bench.vehicle().drive().head_turns_per_s_at(bench.bench.now_ns()) != 0);
  // A quarter of a second at 6000 rpm/s, and the drive's word for it; the ramp alone takes a second.
  CHECK(bench.run(stop, 2, 60 * ns_per_s, true) < 700 * ns_per_ms);
  CHECK(bench.bench.vehicle().drive().head_turns_per_s_at(bench.bench.now_ns()) == 0);
  CHECK(stop.is_motor_confirmed());
}

TEST_CASE("a drive that is silent is not said to stand, and the end comes all the same") {
  StopBench bench;
  bench.bench.vehicle().rig().inject({sim::Fault::node_absent, bench.bench.now_ns(), sim::for_ever_ns, 0});
  OrderlyStop stop(bench.pipeline, {});
  bench.run(stop, 1, 60 * ns_per_s, true);
  REQUIRE(stop.stage() == StopStage::finished);
  CHECK_FALSE(stop.is_motor_confirmed());
  CHECK(bench.pipeline.scanner().phase() == ScannerPhase::left);
  CHECK_FALSE(bench.notices.has("scanner: stopped"));
  CHECK(bench.notices.has("the drive did not confirm that the motor stands without torque"));
  CHECK(bench.bench.vehicle().drive().head_turns_per_s_at(bench.bench.now_ns()) != 0);  // and rightly so
  CHECK(bench.pipeline.finish_recording());
}
