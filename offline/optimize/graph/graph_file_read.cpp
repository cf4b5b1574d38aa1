#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <vector>

#include "graph_file.h"
#include "graph_start.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/text_numbers.h"
#include "planar_pose.h"

namespace alces::offline {
namespace {

// How far a quaternion may be from unit length before it is no rounding of a text file any more.
constexpr double quaternion_tolerance = 0.01;

// Beyond this a pose is a slip, not a place: squares of it times any information stay finite.
constexpr double farthest_position_m = 1e12;

enum class Kind : std::uint8_t { vertex, edge, fix };

struct Tag {
  std::string_view name;
  Kind kind;
  bool is_planar;
  GraphFormat format;
  std::size_t pose_numbers;
};

constexpr std::array<Tag, 9> tags = {{
    {"VERTEX_SE3:QUAT", Kind::vertex, false, GraphFormat::g2o, 7},
    {"EDGE_SE3:QUAT", Kind::edge, false, GraphFormat::g2o, 7},
    {"VERTEX_SE2", Kind::vertex, true, GraphFormat::g2o, 3},
    {"EDGE_SE2", Kind::edge, true, GraphFormat::g2o, 3},
    {"VERTEX3", Kind::vertex, false, GraphFormat::toro, 6},
    {"EDGE3", Kind::edge, false, GraphFormat::toro, 6},
    {"VERTEX2", Kind::vertex, true, GraphFormat::toro, 3},
    {"EDGE2", Kind::edge, true, GraphFormat::toro, 3},
    {"FIX", Kind::fix, false, GraphFormat::g2o, 0},
}};

constexpr std::size_t most_numbers = 7 + 21;

constexpr const char* what_is_read =
    "VERTEX_SE3:QUAT, EDGE_SE3:QUAT, VERTEX_SE2, EDGE_SE2 and FIX of g2o, and VERTEX3, EDGE3, VERTEX2 and "
    "EDGE2 of TORO are read";

Pose euler_pose(std::span<const double> n) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  Pose pose;
  pose.translation_m = {n[0], n[1], n[2]};
  pose.rotation = AngleAxisd(n[5], Vector3d::UnitZ()) * AngleAxisd(n[4], Vector3d::UnitY()) *
                  AngleAxisd(n[3], Vector3d::UnitX());
  return pose;
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file) {
    read_file(file, bytes_);
    at_ = bytes_.data();
    end_ = at_ + bytes_.size();
  }

  GraphFile read() {
    for (line_ = 1; at_ < end_; ++line_) {
      skip_blanks();
      if (*at_ == '#') {
        while (!is_line_end()) ++at_;
      } else if (!is_line_end()) {
        read_line();
      }
      ++at_;
    }
    if (result_.graph.vertices.empty()) {
      if (result_.graph.constraints.empty())
        throw InputError(file_, std::string("holds no pose graph; ") + what_is_read);
      make_vertices();
    }
    resolve_edges();
    resolve_fixes();
    if (!result_.has_poses) {
      start_from_odometry(result_.graph);
      // it holds the first vertex where none is fixed; the file did not say so
      if (fixes_.empty()) result_.graph.vertices.front().is_fixed = false;
    }
    return std::move(result_);
  }

 private:
  /// What an edge says until all vertices are known.
  struct Ends {
    std::int64_t from = 0;
    std::int64_t to = 0;
    std::size_t line = 0;
  };

  [[noreturn]] void fail(const std::string& sentence) const { throw InputError(file_, line_, sentence); }

  // bytes_ ends in a 0 that is not part of it, so that looking at *at_ is always allowed
  [[nodiscard]] bool is_line_end() const { return at_ >= end_ || *at_ == '\n'; }
  void skip_blanks() {
    while (is_blank(*at_)) ++at_;
  }

  void read_line() {
    const char* const begin = at_;
    while (!is_line_end() && !is_blank(*at_)) ++at_;
    const std::string_view name(begin, static_cast<std::size_t>(at_ - begin));
    for (const Tag& tag : tags) {
      if (tag.name != name) continue;
      if (tag.kind == Kind::fix) return read_fix();
      check_dimension(tag);
      if (tag.kind == Kind::vertex) return read_vertex(tag);
      return read_edge(tag);
    }
    constexpr std::size_t most_shown = 40;
    fail(fmt::format("the tag '{}' is not known; {}", name.substr(0, most_shown), what_is_read));
  }

  void check_dimension(const Tag& tag) {
    if (!first_tag_) {
      first_tag_ = &tag;
      result_.format = tag.format;
      result_.graph.is_planar = tag.is_planar;
    } else if (first_tag_->is_planar != tag.is_planar) {
      fail(fmt::format("{} in a file that began with {}; a graph is 2D or 3D throughout", tag.name,
                       first_tag_->name));
    }
  }

  std::int64_t read_id(std::string_view tag) {
    skip_blanks();
    std::int64_t id = 0;
    const auto [stop, error] = std::from_chars(at_, end_, id);
    if (error == std::errc::result_out_of_range || (error == std::errc{} && id < 0)) {
      fail(fmt::format("an id of {} is not between 0 and {}", tag, std::numeric_limits<std::int64_t>::max()));
    }
    if (error != std::errc{} || !ends_number(*stop)) {
      fail(fmt::format("{} needs a vertex's id here, a whole number; is the line cut off?", tag));
    }
    at_ = stop;
    return id;
  }

  std::span<const double> read_numbers(const Tag& tag, std::size_t expected) {
    std::size_t count = 0;
    for (skip_blanks(); !is_line_end(); skip_blanks()) {
      double number = 0;
      const char* const stop = parse_number(at_, end_, number);
      if (stop == nullptr) {
        fail(fmt::format("{} goes on with something that is no number after the first {}", tag.name, count));
      }
      if (!std::isfinite(number)) fail(fmt::format("{} holds NaN or Inf; remove or correct it", tag.name));
      if (count < expected) numbers_[count] = number;
      ++count;
      at_ = stop;
    }
    if (count != expected) {
      fail(fmt::format("{} has {} numbers after its ids, {} are expected{}", tag.name, count, expected,
                       count < expected ? "; is the line cut off?" : ""));
    }
    return std::span(numbers_).first(expected);
  }

  Pose pose_of(const Tag& tag, std::span<const double> n) const {
    Pose pose;
    if (tag.is_planar) {
      pose = planar_pose(n[0], n[1], n[2]);
    } else if (tag.format == GraphFormat::toro) {
      pose = euler_pose(n);
    } else {
      pose.translation_m = {n[0], n[1], n[2]};
      pose.rotation = Eigen::Quaterniond(n[6], n[3], n[4], n[5]);
      const double length = pose.rotation.norm();
      if (!(std::abs(length - 1) < quaternion_tolerance)) {
        fail(fmt::format("the quaternion has length {:.4g} instead of 1; the order is x y z qx qy qz qw",
                         length));
      }
      pose.rotation.normalize();
    }
    if (pose.translation_m.cwiseAbs().maxCoeff() > farthest_position_m)
      fail(fmt::format("a position beyond {:g} m is no place; correct it", farthest_position_m));
    return pose;
  }

  void read_vertex(const Tag& tag) {
    ConstraintVertex vertex;
    vertex.id = read_id(tag.name);
    vertex.map_from_body = pose_of(tag, read_numbers(tag, tag.pose_numbers));
    const auto place = static_cast<std::uint32_t>(result_.graph.vertices.size());
    const auto [known, is_new] = place_of_id_.emplace(vertex.id, place);
    if (!is_new) {
      fail(fmt::format("vertex {} has been given before, as the {}. vertex of the file; remove one of them",
                       vertex.id, known->second + 1));
    }
    result_.graph.vertices.push_back(vertex);
  }

  void read_edge(const Tag& tag) {
    Ends ends{.from = read_id(tag.name), .to = read_id(tag.name), .line = line_};
    if (ends.from == ends.to) fail(fmt::format("an edge from vertex {} to itself; remove it", ends.from));
    const std::size_t information_numbers = tag.is_planar ? 6 : 21;
    const std::span<const double> n = read_numbers(tag, tag.pose_numbers + information_numbers);
    Constraint constraint;
    constraint.from_from_to = pose_of(tag, n);
    const std::span<const double> i = n.subspan(tag.pose_numbers);
    bool is_positive_definite = false;
    if (tag.is_planar) {
      Eigen::Matrix3d& information = constraint.planar_information;
      if (tag.format == GraphFormat::toro) {
        information << i[0], i[1], i[4], i[1], i[2], i[5], i[4], i[5], i[3];
      } else {
        information << i[0], i[1], i[2], i[1], i[3], i[4], i[2], i[4], i[5];
      }
      is_positive_definite = information.llt().info() == Eigen::Success;
    } else {
      std::size_t k = 0;
      for (int row = 0; row < 6; ++row) {
        for (int column = row; column < 6; ++column) {
          constraint.information(row, column) = constraint.information(column, row) = i[k++];
        }
      }
      if (tag.format == GraphFormat::toro) {
        constraint.information.rightCols<3>() *= 2;  // see graph_file.h
        constraint.information.bottomRows<3>() *= 2;
      }
      is_positive_definite = constraint.information.llt().info() == Eigen::Success;
    }
    if (!is_positive_definite) {
      fail(
          fmt::format("the information of the edge from {} to {} is not positive definite; correct it, or "
                      "remove the edge",
                      ends.from, ends.to));
    }
    result_.graph.constraints.push_back(constraint);
    ends_.push_back(ends);
  }

  void read_fix() {
    do {
      fixes_.push_back({.from = read_id("FIX"), .line = line_});
      skip_blanks();
    } while (!is_line_end());
  }

  [[nodiscard]] std::uint32_t place_of(std::int64_t id, std::size_t line, std::string_view who) const {
    const auto place = place_of_id_.find(id);
    if (place == place_of_id_.end()) {
      throw InputError(file_, line,
                       fmt::format("{} vertex {}, which the file does not hold; is it cut off?", who, id));
    }
    return place->second;
  }

  /// Edges alone, as SE-Sync and DPGO have them: a vertex for each number that they name, in its order.
  void make_vertices() {
    std::set<std::int64_t> ids;
    for (const Ends& ends : ends_) {
      ids.insert(ends.from);
      ids.insert(ends.to);
    }
    for (const std::int64_t id : ids) {
      place_of_id_.emplace(id, static_cast<std::uint32_t>(result_.graph.vertices.size()));
      result_.graph.vertices.push_back({id, Pose{}, false});
    }
    result_.has_poses = false;
  }

  void resolve_edges() {
    for (std::size_t i = 0; i < ends_.size(); ++i) {
      Constraint& constraint = result_.graph.constraints[i];
      constraint.from = place_of(ends_[i].from, ends_[i].line, "an edge from");
      constraint.to = place_of(ends_[i].to, ends_[i].line, "an edge to");
    }
  }

  void resolve_fixes() {
    for (const Ends& fix : fixes_)
      result_.graph.vertices[place_of(fix.from, fix.line, "FIX of")].is_fixed = true;
  }

  const std::filesystem::path& file_;
  std::string bytes_;
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  std::size_t line_ = 0;
  const Tag* first_tag_ = nullptr;
  std::array<double, most_numbers> numbers_{};
  std::unordered_map<std::int64_t, std::uint32_t> place_of_id_;
  std::vector<Ends> ends_;   // beside the graph's constraints
  std::vector<Ends> fixes_;  // `from` only
  GraphFile result_;
};

}  // namespace

GraphFile read_graph(const std::filesystem::path& file) {
  return Reader(file).read();
}

}  // namespace alces::offline
