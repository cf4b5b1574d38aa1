#include "alces_onboard/mapping_worker.h"

#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "alces_platform/sim/drive.h"

using namespace alces;
using namespace alces::onboard;

namespace {

constexpr std::uint32_t scans = 100;

const sim::Drive& town_drive() {
  static const sim::Drive drive = [] {
    sim::DriveSettings settings;
    settings.scans = scans;
    settings.scanner.points_per_scan = 6000;
    return sim::drive(settings);
  }();
  return drive;
}

MappingWorkerConfig worker_config() {
  MappingWorkerConfig config;
  config.mapper.scan_capacity = scans;
  config.mapper.loop_capacity = 32;
  config.mapper.pool_bytes = std::size_t{6} << 20;
  config.mapper.voxel.cell_capacity = 6144;
  config.scan_slots = 3;
  config.points_per_scan = 8000;
  return config;
}

void put(ScanSlot& slot, std::uint32_t number) {
  std::vector<Point> points;
  town_drive().points(number, points);
  slot.scan = {};
  slot.scan.number = number;
  slot.scan.reference_stamp_ns = std::int64_t{1000} * number;
  slot.scan.has_odometry = true;
  slot.scan.odometry_from_body = town_drive().odometry(number);
  std::copy(points.begin(), points.end(), slot.room.begin());
  slot.point_count = static_cast<std::uint32_t>(points.size());
}

std::vector<Pose> map_directly() {
  const MapperConfig config = worker_config().mapper;
  settings::MemoryBlock block(Mapper::memory_required(config));
  Status status = Status::ok;
  Mapper* const mapper = Mapper::create(block.bytes(), config, status);
  REQUIRE(mapper != nullptr);
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < scans; ++i) {
    town_drive().points(i, points);
    ScanReport report;
    REQUIRE(mapper->add_scan(points, &town_drive().odometry(i), report) == Status::ok);
  }
  LoopReport loop;
  mapper->finish(loop);
  return {mapper->graph().poses().begin(), mapper->graph().poses().end()};
}

}  // namespace

TEST_CASE(
    "a mapping worker makes the map that the mapper makes, and tells of all its edges, loops and paths") {
  MappingWorker worker(worker_config(), nullptr, nullptr);
  REQUIRE(worker.status() == Status::ok);
  std::uint32_t edges = 0;
  std::uint32_t loop_edges = 0;
  std::uint32_t paths = 0;
  bool has_ended = false;
  MapHealth health;
  const auto take = [&] {
    while (const MapResult* const result = worker.front_result()) {
      edges += result->edge_count;
      for (const Edge& edge : std::span(result->edges).first(result->edge_count))
        loop_edges += edge.closes_loop ? 1U : 0U;
      health = result->health;
      if (!result->is_end) {
        CHECK(result->scan.was_mapped);
        CHECK(health.scans > 0);
        CHECK(health.scans + 50 > result->figures.scans);
        CHECK(result->cloud.size() == result->scan.points_reduced);
      }
      if (result->has_path) {
        ++paths;
        CHECK(worker.path().size() == result->figures.scans);
        CHECK(worker.path_stamps_ns().back() == std::int64_t{1000} * (result->figures.scans - 1));
        CHECK(worker.path().back().translation_m == result->map_from_body.translation_m);
        worker.take_path();
      }
      has_ended = result->is_end;
      worker.pop_result();
    }
  };
  for (std::uint32_t i = 0; i < scans; ++i) {
    ScanSlot* const slot = worker.claim_scan();
    REQUIRE(slot != nullptr);
    put(*slot, i);
    worker.publish_scan();
    REQUIRE(worker.run_once());
    take();
  }
  CHECK_FALSE(worker.run_once());
  worker.close();
  REQUIRE(worker.run_once());
  take();
  CHECK(has_ended);
  CHECK(worker.is_finished());
  CHECK_FALSE(worker.run_once());

  const Mapper& mapper = worker.mapper();
  CHECK(edges == mapper.graph().edge_count());
  CHECK(loop_edges == mapper.counters().loops_closed);
  CHECK(mapper.counters().loops_closed > 0);
  CHECK(paths == mapper.counters().loops_closed);
  CHECK(health.scans == scans);
  CHECK(health.closed == mapper.counters().loops_closed);
  CHECK(health.verdict == mapper.health().verdict);
  CHECK(health.verdict == MapVerdict::good);
  const std::vector<Pose> direct = map_directly();
  REQUIRE(direct.size() == scans);
  for (std::uint32_t i = 0; i < scans; ++i) {
    REQUIRE(mapper.graph().poses()[i].translation_m == direct[i].translation_m);
    REQUIRE(mapper.graph().poses()[i].rotation.coeffs() == direct[i].rotation.coeffs());
  }
}

TEST_CASE("a worker waits when nobody takes its results, and a path that nobody took is not written over") {
  MappingWorkerConfig config = worker_config();
  config.scan_slots = 2;
  MappingWorker worker(config, nullptr, nullptr);
  for (std::uint32_t i = 0; i < 2; ++i) {
    put(*worker.claim_scan(), i);
    worker.publish_scan();
  }
  CHECK(worker.claim_scan() == nullptr);
  CHECK(worker.run_once());
  CHECK(worker.run_once());
  put(*worker.claim_scan(), 2);
  worker.publish_scan();
  CHECK_FALSE(worker.run_once());  // two results wait
  CHECK(worker.waiting_scans() == 1);
  REQUIRE(worker.front_result() != nullptr);
  CHECK(worker.front_result()->scan.number == 0);
  worker.pop_result();
  CHECK(worker.run_once());
}

TEST_CASE("on its own thread a worker hands back one result a scan, in order, then the end") {
  MappingWorker worker(worker_config(), nullptr, nullptr);
  worker.start_thread();
  std::uint32_t sent = 0;
  std::uint32_t received = 0;
  bool has_ended = false;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (!has_ended && std::chrono::steady_clock::now() < deadline) {
    if (sent < 30) {
      if (ScanSlot* const slot = worker.claim_scan()) {
        put(*slot, sent);
        worker.publish_scan();
        if (++sent == 30) worker.close();
      }
    }
    while (const MapResult* const result = worker.front_result()) {
      has_ended = result->is_end;
      if (!has_ended) CHECK(result->scan.number == received++);
      if (result->has_path) worker.take_path();
      worker.pop_result();
    }
    std::this_thread::yield();
  }
  REQUIRE(has_ended);
  CHECK(worker.join_within(10 * ns_per_s));
  CHECK(received == 30);
  CHECK(worker.mapper().scan_count() == 30);
}
