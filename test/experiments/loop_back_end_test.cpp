// Maps of the synthetic town whose loops TORO and HOG-Man close in LOA's place.
#include "experiments/back_ends/loop_back_ends.h"

#include <array>
#include <catch2/catch.hpp>

#include "alces/mapper.h"
#include "alces_platform/sim/drive.h"
#include "offline/io/files/error.h"
#include "support/in_block.h"

using namespace alces;
using namespace alces::offline;
using namespace alces::test;

namespace {

double distance_m(const Pose& a, const Pose& b) {
  return (a.translation_m - b.translation_m).norm();
}

std::unique_ptr<GraphRelaxation> made(const std::string& back_end) {
  add_loop_back_ends();
  return make_graph_relaxation(back_end);
}

struct TownMap {
  std::string back_end;
  std::unique_ptr<GraphRelaxation> relaxation;
  Block block;
  Mapper* mapper = nullptr;

  TownMap(const std::string& chosen, const MapperConfig& config)
      : back_end(chosen), relaxation(made(chosen)), block(Mapper::memory_required(config)) {
    Status status = Status::bad_config;
    mapper = Mapper::create(block.bytes(), config, status, nullptr, nullptr, relaxation.get());
    REQUIRE(mapper != nullptr);
  }
};

PoseGraph::Capacity small() {
  return {8, 8};
}

}  // namespace

TEST_CASE("back ends that were added are offered between elch and none, and made by their names") {
  add_loop_back_ends();
  add_loop_back_ends();  // once more: nothing doubles
  CHECK(loop_back_end_names() == std::vector<std::string>{"elch", "toro", "hogman", "none"});
  CHECK(make_graph_relaxation("toro") != nullptr);
  CHECK(make_graph_relaxation("hogman") != nullptr);
  CHECK(make_graph_relaxation("elch") == nullptr);
  CHECK(make_graph_relaxation("none") == nullptr);
  CHECK_THROWS_AS(make_graph_relaxation("g2o"), UsageError);
}

TEST_CASE(
    "TORO and HOG-Man in LOA's place bring a drive through the town as near to the truth as ELCH does") {
  sim::DriveSettings settings;
  settings.scans = 115;
  settings.seed = 1;
  settings.scanner.points_per_scan = 12000;
  const sim::Drive drive = sim::drive(settings);
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = static_cast<std::uint32_t>(drive.size());
  config.loop_capacity = 64;
  config.pool_bytes = std::size_t{16} << 20;
  config.voxel.cell_capacity = 12288;

  TownMap elch("elch", config);
  TownMap toro("toro", config);
  TownMap hogman("hogman", config);
  const std::array maps{&elch, &toro, &hogman};
  std::vector<Point> points;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    drive.points(i, points);
    for (const TownMap* map : maps) {
      ScanReport report;
      const Status status = map->mapper->add_scan(points, &drive.odometry(i), report);
      REQUIRE((status == Status::ok || status == Status::no_voxel_capacity));
    }
  }
  std::array<double, 3> error_m{};
  for (std::size_t m = 0; m < maps.size(); ++m) {
    LoopReport loop;
    maps[m]->mapper->finish(loop);
    for (std::uint32_t i = 0; i < maps[m]->mapper->scan_count(); ++i)
      error_m[m] +=
          distance_m(maps[m]->mapper->graph().poses()[i], drive.truth(i)) / maps[m]->mapper->scan_count();
    CAPTURE(maps[m]->back_end, maps[m]->relaxation ? maps[m]->relaxation->problem() : "");
    CHECK(maps[m]->mapper->counters().loops_closed >= 1);
    CHECK(maps[m]->mapper->counters().loops_not_relaxed == 0);
    CHECK(maps[m]->mapper->graph().poses()[0].translation_m == Eigen::Vector3d::Zero());
  }
  CAPTURE(error_m[0], error_m[1], error_m[2]);
  CHECK(error_m[1] < 0.5);
  CHECK(error_m[2] < 0.5);
}

TEST_CASE("a relaxation that its optimiser refuses changes nothing and says why") {
  const std::string back_end = GENERATE(std::string("toro"), std::string("hogman"));
  InBlock<PoseGraph> graph(small());
  Pose there;
  for (int i = 0; i < 3; ++i) {
    there.translation_m.x() = i;
    REQUIRE(graph->add_vertex(there) == Status::ok);
  }
  Edge edge;
  edge.to = 1;
  edge.from_from_to.translation_m.x() = 1;
  REQUIRE(graph->add_edge(edge) == Status::ok);  // nothing joins the third vertex
  const std::unique_ptr<GraphRelaxation> relaxation = made(back_end);
  CHECK_FALSE(relaxation->relax(*graph, graph->poses()));
  CHECK_THAT(relaxation->problem(), Catch::Contains("falls into 2 parts"));
  for (int i = 0; i < 3; ++i) CHECK(graph->poses()[static_cast<std::size_t>(i)].translation_m.x() == i);
}
