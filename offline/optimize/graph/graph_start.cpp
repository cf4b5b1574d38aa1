#include "graph_start.h"

#include <Eigen/SVD>
#include <algorithm>
#include <deque>
#include <memory>
#include <vector>

#include "alces/pose_graph.h"
#include "block_system.h"
#include "planar_pose.h"

namespace alces::offline {
namespace {

bool joins_neighbours(const Constraint& c) {
  return c.from + 1 == c.to || c.to + 1 == c.from;
}

// Which constraints touch a vertex, in the graph's order.
struct Adjacency {
  explicit Adjacency(const ConstraintGraph& graph) : first(graph.vertices.size() + 1, 0) {
    for (const Constraint& c : graph.constraints) {
      ++first[c.from + std::size_t{1}];
      ++first[c.to + std::size_t{1}];
    }
    for (std::size_t i = 0; i + 1 < first.size(); ++i) first[i + 1] += first[i];
    constraints.resize(2 * graph.constraints.size());
    std::vector<std::uint32_t> at(first.begin(), first.end() - 1);
    for (std::uint32_t i = 0; i < graph.constraints.size(); ++i) {
      constraints[at[graph.constraints[i].from]++] = i;
      constraints[at[graph.constraints[i].to]++] = i;
    }
  }
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> constraints;
};

// Breadth first from the fixed vertices; with `chain_first` an edge between consecutive vertices is as good
// as none.
void place_along_tree(ConstraintGraph& graph, bool chain_first) {
  ensure_fixed(graph);
  const Adjacency adjacency(graph);
  std::vector<bool> is_placed(graph.vertices.size(), false);
  struct Way {
    std::uint32_t constraint;
    std::uint32_t to;
  };
  std::deque<Way> ways;
  const auto leave = [&](std::uint32_t vertex) {
    is_placed[vertex] = true;
    for (std::uint32_t k = adjacency.first[vertex]; k < adjacency.first[vertex + std::size_t{1}]; ++k) {
      const Constraint& c = graph.constraints[adjacency.constraints[k]];
      const std::uint32_t to = c.from == vertex ? c.to : c.from;
      if (is_placed[to]) continue;
      if (chain_first && joins_neighbours(c)) {
        ways.push_front({adjacency.constraints[k], to});
      } else {
        ways.push_back({adjacency.constraints[k], to});
      }
    }
  };
  for (std::uint32_t vertex = 0; vertex < graph.vertices.size(); ++vertex) {
    if (graph.vertices[vertex].is_fixed) leave(vertex);
  }
  while (!ways.empty()) {
    const Way way = ways.front();
    ways.pop_front();
    if (is_placed[way.to]) continue;
    const Constraint& c = graph.constraints[way.constraint];
    Pose& pose = graph.vertices[way.to].map_from_body;
    if (c.to == way.to) {
      pose = graph.vertices[c.from].map_from_body * c.from_from_to;
    } else {
      pose = graph.vertices[c.to].map_from_body * c.from_from_to.inverse();
    }
    leave(way.to);
  }
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, 1);
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

// Sums  w |x_to - M x_from - c|^2  over edges, x of fixed vertices known: the normal equations' right side is
// kept beside the matrix.
class EdgeLeastSquares {
 public:
  EdgeLeastSquares(const ConstraintGraph& graph, Eigen::Index columns) {
    unknown_.assign(graph.vertices.size(), no_index);
    for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
      if (!graph.vertices[i].is_fixed) unknown_[i] = count_++;
    }
    std::vector<BlockSystem::Pair> pairs;
    for (const Constraint& c : graph.constraints) {
      if (unknown_[c.from] != no_index && unknown_[c.to] != no_index)
        pairs.emplace_back(unknown_[c.from], unknown_[c.to]);
    }
    if (count_ > 0) system_ = std::make_unique<BlockSystem>(count_, 3, pairs);
    right_ = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(count_), columns);
  }

  template <typename Known>
  void add(const Constraint& edge, const Eigen::Matrix3d& weight, const Eigen::Matrix3d& m,
           const Eigen::MatrixXd& c, const Known& known) {
    const std::uint32_t i = unknown_[edge.from];
    const std::uint32_t j = unknown_[edge.to];
    const Eigen::Matrix3d wm = weight * m;
    if (i != no_index) system_->add<3>(i, i, m.transpose() * wm);
    if (j != no_index) system_->add<3>(j, j, weight);
    if (i != no_index && j != no_index) system_->add<3>(j, i, -wm);
    Eigen::MatrixXd residual = -c;  // of what is known
    if (i == no_index) residual -= m * known(edge.from);
    if (j == no_index) residual += known(edge.to);
    if (i != no_index) right_.middleRows<3>(3 * Eigen::Index{i}) += wm.transpose() * residual;
    if (j != no_index) right_.middleRows<3>(3 * Eigen::Index{j}) -= weight * residual;
  }

  /// False: not positive definite, of a graph that is not connected.
  [[nodiscard]] bool solve() {
    if (count_ == 0 || !system_->factorize(0)) return false;
    right_ = system_->solve(right_);
    return true;
  }
  [[nodiscard]] bool is_unknown(std::size_t vertex) const { return unknown_[vertex] != no_index; }
  [[nodiscard]] auto operator[](std::size_t vertex) const {
    return right_.middleRows<3>(3 * Eigen::Index{unknown_[vertex]});
  }

 private:
  std::uint32_t count_ = 0;
  std::vector<std::uint32_t> unknown_;
  std::unique_ptr<BlockSystem> system_;
  Eigen::MatrixXd right_;
};

bool solve_orientations(ConstraintGraph& graph) {
  // transposed, a measurement R_to = R_from R_edge reads x_to = R_edge^T x_from
  EdgeLeastSquares sums(graph, 3);
  const auto known = [&](std::uint32_t vertex) -> Eigen::Matrix3d {
    return graph.vertices[vertex].map_from_body.rotation.toRotationMatrix().transpose();
  };
  for (const Constraint& c : graph.constraints) {
    const double weight =
        graph.is_planar ? c.planar_information(2, 2) : c.information.bottomRightCorner<3, 3>().trace() / 3;
    sums.add(c, weight * Eigen::Matrix3d::Identity(), c.from_from_to.rotation.toRotationMatrix().transpose(),
             Eigen::Matrix3d::Zero(), known);
  }
  if (!sums.solve()) return false;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    if (!sums.is_unknown(i)) continue;
    Pose& pose = graph.vertices[i].map_from_body;
    pose.rotation = Eigen::Quaterniond(nearest_rotation(Eigen::Matrix3d(sums[i]).transpose()));
    if (graph.is_planar)
      pose = planar_pose(pose.translation_m.x(), pose.translation_m.y(), heading_rad(pose));
  }
  return true;
}

void solve_positions(ConstraintGraph& graph) {
  EdgeLeastSquares sums(graph, 1);
  const auto known = [&](std::uint32_t vertex) -> Eigen::Vector3d {
    return graph.vertices[vertex].map_from_body.translation_m;
  };
  for (const Constraint& c : graph.constraints) {
    Eigen::Matrix3d in_edge = Eigen::Matrix3d::Identity();  // a planar graph's z: any weight, it is 0
    if (graph.is_planar) {
      in_edge.topLeftCorner<2, 2>() = c.planar_information.topLeftCorner<2, 2>();
    } else {
      in_edge = c.information.topLeftCorner<3, 3>();
    }
    const Eigen::Quaterniond& map_from_from = graph.vertices[c.from].map_from_body.rotation;
    const Eigen::Matrix3d r = (map_from_from * c.from_from_to.rotation).toRotationMatrix();
    sums.add(c, r * in_edge * r.transpose(), Eigen::Matrix3d::Identity(),
             map_from_from * c.from_from_to.translation_m, known);
  }
  if (!sums.solve()) return;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    if (sums.is_unknown(i)) graph.vertices[i].map_from_body.translation_m = sums[i];
    if (graph.is_planar) graph.vertices[i].map_from_body.translation_m.z() = 0;
  }
}

}  // namespace

std::size_t ensure_fixed(ConstraintGraph& graph) {
  const auto count = std::count_if(graph.vertices.begin(), graph.vertices.end(),
                                   [](const ConstraintVertex& v) { return v.is_fixed; });
  if (count > 0 || graph.vertices.empty()) return static_cast<std::size_t>(count);
  graph.vertices.front().is_fixed = true;
  return 1;
}

void start_from_odometry(ConstraintGraph& graph) {
  place_along_tree(graph, true);
}

void start_from_spanning_tree(ConstraintGraph& graph) {
  place_along_tree(graph, false);
}

void start_from_chordal(ConstraintGraph& graph) {
  ensure_fixed(graph);
  if (solve_orientations(graph)) solve_positions(graph);
}

}  // namespace alces::offline
