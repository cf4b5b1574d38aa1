// Maps of the synthetic town whose loops TORO and HOG-Man close in LOA's place.
#include "offline/optimize/graph/loop_back_end.h"

#include <array>
#include <catch2/catch.hpp>

#include "alces/mapper.h"
#include "alces_platform/sim/drive.h"
#include "support/in_block.h"

using namespace alces;
using namespace alces::offline;
using namespace alces::test;

namespace {

double distance_m(const Pose& a, const Pose& b) {
  return (a.translation_m - b.translation_m).norm();
}

struct TownMap {
  LoopBackEnd back_end;
  std::unique_ptr<GraphRelaxation> relaxation;
  Block block;
  Mapper* mapper = nullptr;

  TownMap(LoopBackEnd chosen, const MapperConfig& config)
      : back_end(chosen), relaxation(make_graph_relaxation(chosen)), block(Mapper::memory_required(config)) {
    Status status = Status::bad_config;
    mapper = Mapper::create(block.bytes(), config, status, nullptr, nullptr, relaxation.get());
    REQUIRE(mapper != nullptr);
  }
};

PoseGraph::Capacity small() {
  return {8, 8};
}

}  // namespace

TEST_CASE("the back ends are called as they are named") {
  for (const std::string& each : loop_back_end_names()) {
    REQUIRE(loop_back_end(each));
    CHECK(name(*loop_back_end(each)) == each);
  }
  CHECK_FALSE(loop_back_end("g2o"));
  CHECK(make_graph_relaxation(LoopBackEnd::elch) == nullptr);
  CHECK(make_graph_relaxation(LoopBackEnd::none) == nullptr);
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

  TownMap elch(LoopBackEnd::elch, config);
  TownMap toro(LoopBackEnd::toro, config);
  TownMap hogman(LoopBackEnd::hogman, config);
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
    CAPTURE(name(maps[m]->back_end), maps[m]->relaxation ? maps[m]->relaxation->problem() : "");
    CHECK(maps[m]->mapper->counters().loops_closed >= 1);
    CHECK(maps[m]->mapper->counters().loops_not_relaxed == 0);
    CHECK(maps[m]->mapper->graph().poses()[0].translation_m == Eigen::Vector3d::Zero());
  }
  CAPTURE(error_m[0], error_m[1], error_m[2]);
  CHECK(error_m[1] < 0.5);
  CHECK(error_m[2] < 0.5);
}

TEST_CASE("a relaxation that its optimiser refuses changes nothing and says why") {
  const LoopBackEnd back_end = GENERATE(LoopBackEnd::toro, LoopBackEnd::hogman);
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
  const std::unique_ptr<GraphRelaxation> relaxation = make_graph_relaxation(back_end);
  CHECK_FALSE(relaxation->relax(*graph, graph->poses()));
  CHECK_THAT(relaxation->problem(), Catch::Contains("falls into 2 parts"));
  for (int i = 0; i < 3; ++i) CHECK(graph->poses()[static_cast<std::size_t>(i)].translation_m.x() == i);
}
