#include "offline/optimize/lum/relaxation.h"

#include <catch2/catch.hpp>
#include <limits>

#include "lum_bench.h"
#include "offline/io/files/error.h"
#include "offline/optimize/lum/checkpoint.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

TEST_CASE("disturbed poses come back to where the scans were taken") {
  constexpr std::size_t scans = 12;
  const LumResult result = relax_room(scans, small_settings());
  CHECK(result.is_converged);
  CHECK(worst_distance_m(disturbed(room_poses(scans), 0.08, 0.015, 7), room_poses(scans)) > 0.1);
  CHECK(worst_distance_m(result.map_from_scan, room_poses(scans)) < 0.004);
  for (std::size_t i = 0; i < scans; ++i)
    CHECK(angle_between_rad(result.map_from_scan[i].rotation, room_from_body(i).rotation) < 0.001);
}

TEST_CASE("the paper's whole distances bring them back, too, less closely") {
  LumSettings settings = paper_lum();
  settings.voxel.cell_capacity = 4096;
  settings.link_distance_m = 1.1;
  settings.last_distance_limit_m = 0.5F;
  settings.maximum_iterations = 40;
  const LumResult result = relax_room(12, settings);
  CHECK(worst_distance_m(result.map_from_scan, room_poses(12)) < 0.04);
}

namespace {

/// The first two scans are one and the same, as when a recorder starts twice.
class Stuttering final : public RoomSource {
 public:
  using RoomSource::RoomSource;
  bool read(std::size_t index, ScanPoints& scan) override {
    return RoomSource::read(index < 2 ? 0 : index, scan);
  }
};

}  // namespace

TEST_CASE("two copies of a scan are laid upon each other, whatever is minimised") {
  Stuttering room(6);
  std::vector<Pose> truth = room_poses(6);
  truth[1] = truth[0];
  LumRequest request;
  request.settings = small_settings();
  request.settings.metric = GENERATE(LumMetric::plane, LumMetric::point);
  request.settings.variance_floor_m = 0;
  request.settings.robust_share = 0;
  const LumResult result = optimize_with_lum(numbered(disturbed(truth, 0.03, 0.005, 8)), room, request);
  CHECK((result.map_from_scan[1].translation_m - truth[0].translation_m).norm() < 1e-3);
  CHECK(worst_distance_m(result.map_from_scan, truth) < 0.04);
}

TEST_CASE("scan 0 does not move") {
  const LumResult result = relax_room(6, small_settings());
  CHECK(result.map_from_scan[0].translation_m == room_from_body(0).translation_m);
  CHECK(result.map_from_scan[0].rotation.coeffs() == room_from_body(0).rotation.coeffs());
}

TEST_CASE("the number of threads does not show in a bit") {
  LumSettings settings = small_settings();
  settings.maximum_iterations = 4;
  settings.threads = 1;
  const LumResult one = relax_room(10, settings);
  settings.threads = 4;
  const LumResult four = relax_room(10, settings);
  CHECK(same_bits(one.map_from_scan, four.map_from_scan));
}

TEST_CASE("never more scans are loaded than allowed, and the poses are the same") {
  LumSettings settings = small_settings();
  settings.maximum_iterations = 4;
  const LumResult all = relax_room(14, settings);
  CHECK(all.cache.most_loaded == 14);
  for (const std::uint32_t loaded : {2U, 5U, 6U}) {
    settings.loaded_scans = loaded;
    const LumResult few = relax_room(14, settings);
    CHECK(few.cache.most_loaded <= loaded);
    CHECK(few.cache.prepared == 14);  // read once: then they come from the scratch file
    CHECK(few.cache.brought_back > 0);
    CHECK(same_bits(all.map_from_scan, few.map_from_scan));
  }
}

TEST_CASE("a run that was stopped and resumed ends at the very poses of one that was not") {
  const TemporaryFolder folder;
  const Trajectory start = numbered(disturbed(room_poses(8), 0.08, 0.015, 3));
  LumRequest request;
  request.settings = small_settings();
  request.checkpoint = folder / "out/lum.checkpoint";
  RoomSource room(8);
  const LumResult whole = optimize_with_lum(start, room, request);
  CHECK_FALSE(whole.was_stopped);
  const std::uint32_t stop_after = GENERATE(1U, 3U, 5U);
  std::uint32_t done = 0;
  const LumResult first = optimize_with_lum(start, room, request,
                                            {.iterated = [&](const LumIteration&, auto) { ++done; },
                                             .stop_requested = [&] { return done >= stop_after; }});
  CHECK(first.was_stopped);
  CHECK(first.iterations == stop_after);
  request.resume = true;
  const LumResult second = optimize_with_lum(start, room, request);
  CHECK(second.iterations == whole.iterations);
  CHECK(same_bits(second.map_from_scan, whole.map_from_scan));
}

TEST_CASE("no scan, and one scan, are done at once") {
  for (const std::size_t scans : {std::size_t{0}, std::size_t{1}}) {
    const LumResult result = relax_room(scans, small_settings());
    CHECK(result.iterations == 0);
    CHECK_FALSE(result.was_stopped);
    CHECK(same_bits(result.map_from_scan, room_poses(scans)));
  }
}

namespace {

/// A room of which one scan is spoilt.
class SpoiltRoom final : public RoomSource {
 public:
  enum class Kind { unreadable, empty, not_a_number };
  SpoiltRoom(std::size_t size, std::size_t spoilt, Kind kind)
      : RoomSource(size), spoilt_(spoilt), kind_(kind) {}
  bool read(std::size_t index, ScanPoints& scan) override {
    if (index != spoilt_) return RoomSource::read(index, scan);
    if (kind_ == Kind::unreadable) throw InputError("scan3.synthetic", "ends in the middle");
    scan.clear();
    if (kind_ == Kind::not_a_number) scan.points.assign(100, {std::numeric_limits<float>::quiet_NaN(), 0, 0});
    return true;
  }

 private:
  std::size_t spoilt_;
  Kind kind_;
};

}  // namespace

TEST_CASE("a scan that cannot be read ends it with the reader's sentence, and leaves nothing") {
  const TemporaryFolder folder;
  SpoiltRoom room(6, 3, SpoiltRoom::Kind::unreadable);
  LumRequest request;
  request.settings = small_settings();
  request.checkpoint = folder / "out/lum.checkpoint";
  CHECK_THROWS_WITH(optimize_with_lum(numbered(room_poses(6)), room, request),
                    "scan3.synthetic: ends in the middle");
  CHECK_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_CASE("a scan without a usable point keeps its place behind the one before") {
  SpoiltRoom room(6, 3, GENERATE(SpoiltRoom::Kind::empty, SpoiltRoom::Kind::not_a_number));
  const std::vector<Pose> start = disturbed(room_poses(6), 0.05, 0.01, 5);
  LumRequest request;
  request.settings = small_settings();
  const LumResult result = optimize_with_lum(numbered(start), room, request);
  CHECK(result.cache.empty == 1);
  CHECK(same_pose(result.map_from_scan[2].inverse() * result.map_from_scan[3], start[2].inverse() * start[3],
                  1e-3));
  CHECK((result.map_from_scan[5].translation_m - room_from_body(5).translation_m).norm() < 0.006);
}

TEST_CASE("a map whose scans are gone says which one is missing") {
  RoomSource room(5);
  LumRequest request;
  request.settings = small_settings();
  CHECK_THROWS_WITH(optimize_with_lum(numbered(room_poses(6)), room, request), Contains("scan 5 is missing"));
}

namespace {

std::vector<Pose> circle(std::size_t count) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(count);
    poses.push_back({Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                     {5 * std::cos(angle) - 5, 5 * std::sin(angle), 0.1 * angle}});
  }
  return poses;
}

LumSettings circle_settings() {
  LumSettings settings;
  settings.link_distance_m = 4;
  settings.mean_change_m = 1e-9;
  settings.link_change_m = 0;
  settings.maximum_iterations = 40;
  return settings;
}

class OneWrong final : public WantedLinks {
 public:
  OneWrong(std::vector<Pose> wanted, ScanLink wrong) : WantedLinks(std::move(wanted)), wrong_(wrong) {}
  [[nodiscard]] Pose k_from_j(const ScanLink& link) const override {
    Pose pose = WantedLinks::k_from_j(link);
    if (link == wrong_) pose.translation_m.y() += 0.7;
    return pose;
  }

 private:
  ScanLink wrong_;
};

class Torn final : public WantedLinks {
 public:
  Torn(std::vector<Pose> wanted, std::uint32_t first_beyond)
      : WantedLinks(std::move(wanted)), first_beyond_(first_beyond) {}
  [[nodiscard]] bool sees(const ScanLink& link) const override {
    return (link.j < first_beyond_) == (link.k < first_beyond_);
  }

 private:
  std::uint32_t first_beyond_;
};

}  // namespace

TEST_CASE("links that agree are met exactly") {
  const std::vector<Pose> truth = circle(20);
  WantedLinks links(truth);
  Relaxation relaxation(disturbed(truth, 0.3, 0.05, 11), circle_settings(), links);
  while (!relaxation.is_done()) (void)relaxation.iterate();
  CHECK(relaxation.state().is_converged);
  CHECK(worst_distance_m(relaxation.state().map_from_scan, truth) < 1e-6);
}

TEST_CASE("a wrong link is distrusted, named, and bends the map little") {
  const std::vector<Pose> truth = circle(20);
  const ScanLink wrong{11, 9};
  OneWrong links(truth, wrong);
  LumSettings settings = circle_settings();
  Relaxation switching(disturbed(truth, 0.02, 0.005, 11), settings, links);
  while (!switching.is_done()) (void)switching.iterate();
  std::vector<ScanLink> distrusted;
  for (const LinkOutcome& outcome : switching.outcomes())
    if (outcome.weight < 0.5) distrusted.push_back(outcome.link);
  CHECK(distrusted == std::vector<ScanLink>{wrong});
  settings.switches_links = false;
  Relaxation trusting(disturbed(truth, 0.02, 0.005, 11), settings, links);
  while (!trusting.is_done()) (void)trusting.iterate();
  const double bent_m = worst_distance_m(trusting.state().map_from_scan, truth);
  CHECK(bent_m > 0.1);
  CHECK(worst_distance_m(switching.state().map_from_scan, truth) < 0.1 * bent_m);
}

TEST_CASE("where no links lead over, the map's own poses do, and it is said") {
  const std::vector<Pose> truth = circle(20);
  Torn links(truth, 12);
  const std::vector<Pose> start = disturbed(truth, 0.02, 0.005, 4);
  Relaxation relaxation(start, circle_settings(), links);
  LumIteration last;
  while (!relaxation.is_done()) last = relaxation.iterate();
  CHECK(last.bridges == 1);
  CHECK(relaxation.outcomes().back().is_bridge);
  CHECK(relaxation.outcomes().back().link == ScanLink{12, 11});
  const std::vector<Pose>& poses = relaxation.state().map_from_scan;
  CHECK(same_pose(poses[11].inverse() * poses[12], start[11].inverse() * start[12], 1e-5));
  CHECK(same_pose(poses[13].inverse() * poses[17], truth[13].inverse() * truth[17], 1e-5));
}

TEST_CASE("covariances are the inverse of the cost's curvature") {
  const std::vector<Pose> truth = circle(7);
  WantedLinks links(truth);
  LumSettings settings = circle_settings();
  settings.link_distance_m = 5;
  Relaxation relaxation(truth, settings, links);
  relaxation.look();
  const std::vector<Matrix6d> covariances = relaxation.covariances();
  REQUIRE(covariances.size() == 7);
  CHECK(covariances[0].isZero());
  const double variance_m2 = 0.02 * 0.02 + settings.variance_floor_m * settings.variance_floor_m;
  const std::vector<ScanLink> pairs = find_links(truth, settings);
  const auto cost = [&](const Eigen::VectorXd& x) {  // half the sum of squared Mahalanobis distances
    std::vector<Pose> poses = truth;
    for (std::size_t i = 1; i < poses.size(); ++i) {
      const Vector6d change = x.segment<6>(static_cast<Eigen::Index>(6 * (i - 1)));
      poses[i].translation_m += change.head<3>();
      poses[i].rotation = exp_so3(change.tail<3>()) * poses[i].rotation;
    }
    double sum = 0;
    for (const ScanLink& link : pairs) {
      const Vector6d e = links.offset(link, poses);
      sum += 0.5 * e.dot(WantedLinks::weights() * e) / variance_m2;
    }
    return sum;
  };
  constexpr Eigen::Index size = 36;
  constexpr double h = 1e-4;
  Eigen::MatrixXd hessian(size, size);
  for (Eigen::Index r = 0; r < size; ++r) {
    for (Eigen::Index c = 0; c <= r; ++c) {
      double sum = 0;
      for (const auto& [a, b] : {std::pair(1, 1), std::pair(1, -1), std::pair(-1, 1), std::pair(-1, -1)}) {
        Eigen::VectorXd x = Eigen::VectorXd::Zero(size);
        x[r] += a * h;
        x[c] += b * h;
        sum += a * b * cost(x);
      }
      hessian(r, c) = hessian(c, r) = sum / (4 * h * h);
    }
  }
  const Eigen::MatrixXd inverse = hessian.inverse();
  for (std::size_t i = 1; i < 7; ++i) {
    const auto at = static_cast<Eigen::Index>(6 * (i - 1));
    const Matrix6d expected = inverse.block<6, 6>(at, at);
    CHECK((covariances[i] - expected).norm() < 1e-3 * expected.norm());
  }
}

TEST_CASE("the links as a graph ask for what the links ask for") {
  const std::vector<Pose> truth = circle(8);
  WantedLinks links(truth);
  Relaxation relaxation(disturbed(truth, 1e-4, 1e-4, 2), circle_settings(), links);
  relaxation.look();
  const ConstraintGraph graph = relaxation.link_graph();
  REQUIRE(graph.vertices.size() == 8);
  REQUIRE_FALSE(graph.constraints.empty());
  for (const Constraint& constraint : graph.constraints)
    CHECK(same_pose(constraint.from_from_to, truth[constraint.from].inverse() * truth[constraint.to], 1e-6));
  // chi-squared, g2o's way, is the links' Mahalanobis distance at the poses that were looked at
  double expected = 0;
  for (const LinkOutcome& outcome : relaxation.outcomes())
    expected += outcome.estimate.offset.dot(outcome.estimate.information * outcome.estimate.offset);
  CHECK(chi_squared(graph) == Approx(expected).epsilon(0.01));
}
