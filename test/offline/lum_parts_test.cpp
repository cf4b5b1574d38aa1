// The relaxation's parts: equations, links, batches, checkpoints, shares of other processes.
#include <catch2/catch.hpp>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include "lum_bench.h"
#include "offline/io/files/error.h"
#include "offline/optimize/lum/block_equations.h"
#include "offline/optimize/lum/checkpoint.h"
#include "offline/optimize/lum/shared_link_sums.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

Matrix6d random_matrix(std::mt19937& random, double diagonal) {
  std::normal_distribution<double> normal(0, 1);
  Matrix6d matrix;
  for (Eigen::Index i = 0; i < 36; ++i) matrix.data()[i] = normal(random);
  return matrix * matrix.transpose() + diagonal * Matrix6d::Identity();
}

}  // namespace

TEST_CASE("block equations are solved, and inverted on the diagonal, as dense ones") {
  constexpr std::size_t poses = 30;
  std::mt19937 random(GENERATE(1U, 2U, 3U));
  std::normal_distribution<double> normal(0, 1);
  BlockEquations equations(poses);
  equations.hold(4);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * poses, 6 * poses);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(6 * poses);
  for (std::size_t i = 0; i < 80; ++i) {
    const std::size_t j = i < poses - 1 ? i + 1 : random() % poses;
    const std::size_t k = i < poses - 1 ? i : random() % poses;
    if (j == k) continue;
    const Matrix6d h_j = random_matrix(random, 1);
    const Matrix6d h_k = random_matrix(random, 1);
    const Matrix6d information = random_matrix(random, 2);
    Vector6d b;
    for (Eigen::Index n = 0; n < 6; ++n) b[n] = normal(random);
    equations.add_link(j, h_j, k, h_k, information, b);
    Eigen::MatrixXd row = Eigen::MatrixXd::Zero(6, 6 * poses);
    row.middleCols<6>(static_cast<Eigen::Index>(6 * j)) = h_j;
    row.middleCols<6>(static_cast<Eigen::Index>(6 * k)) = -h_k;
    dense += row.transpose() * information * row;
    right += row.transpose() * b;
  }
  const Eigen::Index held = 6 * 4;
  dense.middleCols<6>(held).setZero();
  dense.middleRows<6>(held).setZero();
  dense.block<6, 6>(held, held).setIdentity();
  right.segment<6>(held).setZero();
  std::vector<Vector6d> changes;
  REQUIRE(equations.solve(changes));
  const Eigen::VectorXd expected = dense.ldlt().solve(right);
  const Eigen::MatrixXd inverse = dense.inverse();
  const std::vector<Matrix6d> covariances = equations.covariances();
  for (std::size_t i = 0; i < poses; ++i) {
    const auto at = static_cast<Eigen::Index>(6 * i);
    CHECK((changes[i] - expected.segment<6>(at)).norm() < 1e-8 * (1 + expected.norm()));
    if (i == 4) {
      CHECK(covariances[i].isZero());
    } else {
      CHECK((covariances[i] - inverse.block<6, 6>(at, at)).norm() < 1e-8 * inverse.norm());
    }
  }
}

TEST_CASE("equations that leave a pose open have no solution") {
  BlockEquations equations(3);
  equations.hold(0);
  equations.add_link(1, Matrix6d::Identity(), 0, Matrix6d::Identity(), Matrix6d::Identity(),
                     Vector6d::Ones());
  std::vector<Vector6d> changes;
  CHECK_FALSE(equations.solve(changes));
  equations.add_prior(2, Matrix6d::Identity());
  CHECK(equations.solve(changes));
  CHECK(changes[1].isApprox(Vector6d::Ones()));
  CHECK(changes[2].isZero());
}

TEST_CASE("links are the pairs within reach, the nearest first, and always the one before") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-20, 20);
  std::vector<Pose> poses(120);
  for (Pose& pose : poses) pose.translation_m = {place(random), place(random), 0.1 * place(random)};
  LumSettings settings;
  settings.link_distance_m = 7;
  settings.links_a_scan = 0;
  std::vector<ScanLink> expected;
  for (std::uint32_t j = 1; j < poses.size(); ++j)
    for (std::uint32_t k = 0; k < j; ++k)
      if (k + 1 == j || (poses[j].translation_m - poses[k].translation_m).norm() <= 7)
        expected.push_back({j, k});
  CHECK(find_links(poses, settings) == expected);
  settings.links_a_scan = 3;
  std::vector<std::size_t> count(poses.size(), 0);
  bool has_previous = true;
  const std::vector<ScanLink> few = find_links(poses, settings);
  for (const ScanLink& link : few) ++count[link.j];
  for (std::uint32_t j = 1; j < poses.size(); ++j)
    has_previous = has_previous && std::find(few.begin(), few.end(), ScanLink{j, j - 1}) != few.end();
  CHECK(*std::max_element(count.begin(), count.end()) == 3);
  CHECK(has_previous);
  CHECK(find_links({}, settings).empty());
}

TEST_CASE("batches hold every link once and need no more scans than allowed") {
  std::mt19937 random(9);
  std::vector<ScanLink> links;
  for (std::uint32_t j = 1; j < 60; ++j)
    for (int n = 0; n < 4; ++n) links.push_back({j, static_cast<std::uint32_t>(random() % j)});
  const std::size_t capacity = GENERATE(2U, 3U, 7U, 16U, 100U);
  std::vector<int> seen(links.size(), 0);
  for (const std::vector<std::size_t>& batch : batch_links(links, capacity)) {
    std::set<std::uint32_t> scans;
    for (const std::size_t i : batch) {
      ++seen[i];
      scans.insert(links[i].j);
      scans.insert(links[i].k);
    }
    CHECK(scans.size() <= capacity);
  }
  CHECK(std::all_of(seen.begin(), seen.end(), [](int times) { return times == 1; }));
}

TEST_CASE("a prepared scan comes back from its bytes as it was, and only from those") {
  LumSettings settings = small_settings();
  ScanPreparation preparation(settings);
  const PreparedScan scan = preparation.prepare(scan_room(3));
  const std::string bytes = scan.to_bytes();
  PreparedScan again;
  REQUIRE(again.from_bytes(bytes));
  CHECK(again.size() == scan.size());
  CHECK(again.to_bytes() == bytes);
  CHECK(again.tree().nearest(Point{1, 1, 1}, 100).index == scan.tree().nearest(Point{1, 1, 1}, 100).index);
  CHECK_FALSE(again.from_bytes(bytes.substr(0, bytes.size() - 1)));
  CHECK_FALSE(again.from_bytes("short"));
  CHECK(preparation.prepare({}).size() == 0);
}

namespace {

LumState some_state() {
  LumState state;
  state.iterations = 7;
  state.distance_limit_m = 0.7F * 0.7F;
  state.links = {{1, 0}, {4, 2}};
  state.map_from_scan = disturbed(room_poses(5), 0.1, 0.1, 1);
  return state;
}

}  // namespace

TEST_CASE("a checkpoint brings the state back to the last bit") {
  const TemporaryFolder folder;
  const LumState state = some_state();
  write_checkpoint(folder / "c", state, "settings");
  const LumState back = read_checkpoint(folder / "c", 5, "settings");
  CHECK(back.iterations == 7);
  CHECK(back.distance_limit_m == state.distance_limit_m);
  CHECK(back.links == state.links);
  CHECK(same_bits(back.map_from_scan, state.map_from_scan));
}

TEST_CASE("a checkpoint that is damaged, or of something else, is refused in a sentence") {
  const TemporaryFolder folder;
  write_checkpoint(folder / "c", some_state(), "settings");
  const std::string bytes = content_of(folder / "c");
  CHECK_THROWS_WITH(read_checkpoint(folder / "c", 5, "others"), Contains("other settings"));
  CHECK_THROWS_WITH(read_checkpoint(folder / "c", 6, "settings"), Contains("holds 5 poses, the map 6"));
  CHECK_THROWS_AS(read_checkpoint(folder / "none", 5, "settings"), InputError);
  for (const std::size_t length : {std::size_t{0}, std::size_t{10}, bytes.size() / 2, bytes.size() - 1}) {
    folder.write("c", std::string_view(bytes).substr(0, length));
    CHECK_THROWS_WITH(read_checkpoint(folder / "c", 5, "settings"), Contains("is damaged"));
  }
  std::string flipped = bytes;
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 1);
  folder.write("c", flipped);
  CHECK_THROWS_WITH(read_checkpoint(folder / "c", 5, "settings"), Contains("is damaged"));
  CHECK_THROWS_AS(write_checkpoint("/dev/full", some_state(), "settings"), OutputError);
}

TEST_CASE("settings that make no sense are refused by name") {
  LumSettings settings;
  CHECK_NOTHROW(check(settings));
  settings.loaded_scans = 1;
  CHECK_THROWS_WITH(check(settings), Contains("loaded scans"));
  settings = {};
  settings.link_distance_m = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(check(settings), Contains("linked scans"));
  settings = {};
  settings.limit_factor = 1;
  CHECK_THROWS_WITH(check(settings), Contains("between 0 and 1"));
}

namespace {

/// Ranks that are threads of this process.
class ThreadRanks {
 public:
  explicit ThreadRanks(std::size_t size) : size_(size), answers_(size) {}

  class Rank final : public ProcessGroup {
   public:
    Rank(ThreadRanks& all, std::size_t rank) : all_(all), rank_(rank) {}
    [[nodiscard]] std::size_t rank() const override { return rank_; }
    [[nodiscard]] std::size_t size() const override { return all_.size_; }
    void broadcast(std::string& bytes) override {
      if (rank_ == 0) all_.message_ = bytes;
      all_.meet();
      bytes = all_.message_;
      all_.meet();
    }
    std::vector<std::string> gather(const std::string& bytes) override {
      all_.answers_[rank_] = bytes;
      all_.meet();
      std::vector<std::string> answers;
      if (rank_ == 0) answers = all_.answers_;
      all_.meet();
      return answers;
    }

   private:
    ThreadRanks& all_;
    std::size_t rank_;
  };

 private:
  void meet() {
    std::unique_lock lock(mutex_);
    const std::size_t round = round_;
    if (++waiting_ == size_) {
      waiting_ = 0;
      ++round_;
      all_here_.notify_all();
    } else {
      all_here_.wait(lock, [&] { return round_ != round; });
    }
  }

  std::size_t size_;
  std::string message_;
  std::vector<std::string> answers_;
  std::mutex mutex_;
  std::condition_variable all_here_;
  std::size_t waiting_ = 0;
  std::size_t round_ = 0;
};

/// A rank whose disk fails on one scan.
class FailingRoom final : public RoomSource {
 public:
  FailingRoom(std::size_t size, std::size_t failing) : RoomSource(size), failing_(failing) {}
  bool read(std::size_t index, ScanPoints& scan) override {
    if (index == failing_) throw InputError("scan9.synthetic", "cannot be read");
    return RoomSource::read(index, scan);
  }

 private:
  std::size_t failing_;
};

LumResult relax_with_ranks(std::size_t ranks, std::size_t failing_scan, std::string& problem) {
  constexpr std::size_t scans = 10;
  LumSettings settings = small_settings();
  settings.maximum_iterations = 4;
  const Trajectory start = numbered(disturbed(room_poses(scans), 0.08, 0.015, 7));
  ThreadRanks all(ranks);
  LumResult result;
  std::vector<std::thread> others;
  const auto run = [&](std::size_t rank) {
    ThreadRanks::Rank group(all, rank);
    FailingRoom room(scans, rank + 1 == ranks ? failing_scan : scans);
    LumRequest request;
    request.settings = settings;
    request.group = &group;
    return optimize_with_lum(start, room, request);
  };
  for (std::size_t rank = 1; rank < ranks; ++rank) others.emplace_back([&run, rank] { (void)run(rank); });
  try {
    result = run(0);
  } catch (const Error& error) {
    problem = error.what();
  }
  for (std::thread& other : others) other.join();
  return result;
}

}  // namespace

TEST_CASE("shared out over 1, 2 and 4 processes the poses are the same to the bit") {
  std::string problem;
  const LumResult one = relax_with_ranks(1, 10, problem);
  const LumResult two = relax_with_ranks(2, 10, problem);
  const LumResult four = relax_with_ranks(4, 10, problem);
  CHECK(problem.empty());
  CHECK(same_bits(one.map_from_scan, two.map_from_scan));
  CHECK(same_bits(one.map_from_scan, four.map_from_scan));
}

TEST_CASE("a scan that one process cannot read ends all of them, with its sentence") {
  std::string problem;
  (void)relax_with_ranks(3, 9, problem);
  CHECK(problem == "scan9.synthetic: cannot be read");
}
