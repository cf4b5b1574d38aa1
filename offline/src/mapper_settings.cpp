#include "alces_offline/mapper_settings.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "alces_offline/error.h"

namespace alces::offline {
namespace {

template <typename Enum>
using Names = std::vector<std::pair<const char*, Enum>>;

template <typename Config, typename Visitor>
void visit_icp(Config& icp, Visitor& visit) {
  visit.choice("metric", icp.metric,
               {{"point_to_point", IcpMetric::point_to_point}, {"surface", IcpMetric::surface}},
               "surface: along the normals, where there is a plane; point_to_point: the paper's");
  visit.number("maximum_iterations", icp.maximum_iterations, 1, 10000, "");
  visit.number("first_distance_limit_m", icp.first_distance_limit_m, 1e-3, 1e3,
               "of a correspondence, in the first iteration");
  visit.number("last_distance_limit_m", icp.last_distance_limit_m, 1e-3, 1e3, "what it shrinks to");
  visit.number("limit_factor", icp.limit_factor, 0.01, 1, "by this much an iteration");
  visit.number("translation_epsilon_m", icp.translation_epsilon_m, 0, 1, "converged when moving less");
  visit.number("rotation_epsilon_rad", icp.rotation_epsilon_rad, 0, 1, "and turning less");
  visit.number("minimum_correspondences", icp.minimum_correspondences, 3, 1e9, "fewer: no match");
  visit.number("coarse_stride", icp.coarse_stride, 1, 1000,
               "every so many samples, until the last distance limit is reached");
  visit.number("robust_factor", icp.robust_factor, 0, 1e6,
               "residuals above this many rms of the last iteration count little; 0: all alike");
  visit.number("robust_scale_m", icp.robust_scale_m, 0, 1e3, "but those below this never do");
  visit.number("rough_weight", icp.rough_weight, 0, 1, "weight of the distance where there is no plane");
  visit.number("degenerate_ratio", icp.degenerate_ratio, 0, 1,
               "smallest over largest curvature below this: a direction is undetermined");
}

/// Every number of a configuration, in the order of the file: the one list that reading and writing share.
template <typename Config, typename Visitor>
void visit_settings(Config& config, Visitor& visit) {
  visit.table("memory", "What does not fit the pool goes to --archive.");
  visit.number("scan_capacity", config.scan_capacity, 0, 1e8, "0: as many as there are scans");
  visit.number("loop_capacity", config.loop_capacity, 0, 1e8, "loops closed");
  visit.number("pool_bytes", config.pool_bytes, 0, 1e15, "of stored scans; 0: what is left of --memory");
  visit.number("cache_slots", config.cache_slots, 1, 1e5, "scans unpacked at a time");
  visit.number("correspondence_capacity", config.correspondence_capacity, 1, 1e8, "of a match");

  visit.table("voxel", "A scan is thinned out to one point a cell.");
  visit.number("cell_size_m", config.voxel.cell_size_m, 1e-3, 100, "");
  visit.choice("representative", config.voxel.representative,
               {{"measured", CellRepresentative::measured},
                {"centroid", CellRepresentative::centroid},
                {"center", CellRepresentative::center}},
               "measured: the point nearest the centroid; or centroid, or center of the cell");
  visit.number("cell_capacity", config.voxel.cell_capacity, 1, 1 << 24,
               "points that a thinned scan can have");
  visit.number("minimum_range_m", config.voxel.minimum_range_m, 0, 1e4, "nearer is the vehicle itself");
  visit.number("maximum_range_m", config.voxel.maximum_range_m, 0, 1e4, "farther points are left out");

  visit.table("surface", "Samples with normals: what moves in a match.");
  visit.number("sample_capacity", config.surface.sample_capacity, 1, 1 << 24, "a scan");
  visit.number("neighbors", config.surface.neighbors, 3, KdTree::maximum_neighbors, "of the plane fit");
  visit.number("neighbor_radius_m", config.surface.neighbor_radius_m, 1e-3, 100, "");

  visit.table("scan_match", "A new scan onto the last ones.");
  visit.number("model_scans", config.model_scans, 1, Icp::maximum_model_scans, "how many; 1: pairwise");
  visit.flag("learn_odometry_heading", config.learn_odometry_heading,
             "predict with the heading offset that matches show the odometry to have");
  visit_icp(config.scan_match, visit);

  visit.table("edge_uncertainty", "What a match is believed to know.");
  visit.flag("label_with_appendix_a", config.label_with_appendix_a,
             "the paper's covariance instead of the curvature minimised on");
  visit.number("inflation", config.edge_uncertainty.inflation, 1e-6, 1e6, "factor on the covariance");
  visit.number("minimum_translation_m", config.edge_uncertainty.minimum_translation_m, 1e-12, 100,
               "standard deviation added on each axis");
  visit.number("minimum_rotation_rad", config.edge_uncertainty.minimum_rotation_rad, 1e-12, 10,
               "standard deviation added about each axis");

  visit.table("detector", "Which earlier scan is near enough to close a loop with.");
  visit.number("radius_m", config.detector.radius_m, 1e-3, 1e4, "");
  visit.number("radius_cap_m", config.detector.radius_cap_m, 1e-3, 1e4,
               "of the reach that uncertainty widens");
  visit.number("sigma_factor", config.detector.sigma_factor, 0, 1e3,
               "reach = radius + factor * standard deviation; 0: always the radius");
  visit.number("minimum_gap_scans", config.detector.minimum_gap_scans, 1, 1e8, "in between");

  visit.table("trigger", "When a loop is closed: at the closest approach.");
  visit.flag("close_loops", config.close_loops, "");
  visit.number("hysteresis_m", config.trigger.hysteresis_m, 0, 1e4,
               "the distance grows when by more than this");
  visit.number("patience_scans", config.trigger.patience_scans, 0, 1e8,
               "or when so many scans came no nearer; 0: do not count them");
  visit.number("repeat_after_scans", config.trigger.repeat_after_scans, 0, 1e8,
               "further loops along the old track; 0: none");

  visit.table("loop_match", "The scans around the end of a loop onto those around its start.");
  visit.number("scans_around_first", config.scans_around_first, 0, 7, "on either side");
  visit.number("scans_before_last", config.scans_before_last, 0, 14, "");
  visit_icp(config.loop_match, visit);

  visit.table("loop_search", "Where the match of a loop starts, when it does not come together straight.");
  visit.number("sure_overlap", config.loop_search.sure_overlap, 0, 1, "from here on no other start is tried");
  visit.number("turn_step_rad", config.loop_search.turn_step_rad, 0, 3.2,
               "starts turned by multiples of this");
  visit.number("turn_steps", config.loop_search.turn_steps, 0, 100, "to each side");
  visit.number("iterations", config.loop_search.iterations, 1, 10000, "of each such start");
  visit.number("candidates", config.loop_search.candidates, 1, 100,
               "scans tried in all, when the nearest is refused");

  visit.table("belief", "When a loop is believed before it bends the map.");
  visit.number("minimum_overlap", config.belief.minimum_overlap, 0, 1, "share of the samples with a partner");
  visit.number("maximum_rms_m", config.belief.maximum_rms_m, 0, 1e3, "of the residuals");
  visit.number("maximum_mahalanobis2", config.belief.maximum_mahalanobis2, 0, 1e12,
               "of the correction, against the uncertainty accumulated along the loop");

  visit.table("sharing", "How the error of a loop is shared out.");
  visit.choice("rule", config.sharing, {{"trails", SharingRule::trails}, {"paper", SharingRule::paper}},
               "trails: into the edges where it most likely arose; paper: by LOA's weights");
}

class TomlWriter {
 public:
  void table(const char* name, const char* comment) {
    text += fmt::format("{}# {}\n[{}]\n", text.empty() ? "" : "\n", comment, name);
  }
  template <typename T>
  void number(const char* key, const T& value, double, double, const char* comment) {
    line(key, fmt::format("{}", value), comment);
  }
  void flag(const char* key, const bool& value, const char* comment) {
    line(key, value ? "true" : "false", comment);
  }
  template <typename Enum>
  void choice(const char* key, const Enum& value, const Names<Enum>& names, const char* comment) {
    for (const auto& [name, named] : names) {
      if (named == value) line(key, fmt::format("\"{}\"", name), comment);
    }
  }
  std::string text;

 private:
  void line(const char* key, const std::string& value, const std::string& comment) {
    const std::string setting = fmt::format("{} = {}", key, value);
    text += comment.empty() ? setting + "\n" : fmt::format("{:<36}# {}\n", setting, comment);
  }
};

class JsonWriter {
 public:
  void table(const char* name, const char*) { table_ = name; }
  template <typename T>
  void number(const char* key, const T& value, double, double, const char*) {
    if constexpr (std::is_same_v<T, float>) {
      json[table_][key] = std::stod(fmt::format("{}", value));  // 0.1, not 0.100000001
    } else {
      json[table_][key] = value;
    }
  }
  void flag(const char* key, const bool& value, const char*) { json[table_][key] = value; }
  template <typename Enum>
  void choice(const char* key, const Enum& value, const Names<Enum>& names, const char*) {
    for (const auto& [name, named] : names) {
      if (named == value) json[table_][key] = name;
    }
  }
  nlohmann::json json;

 private:
  std::string table_;
};

class TomlReader {
 public:
  TomlReader(const std::filesystem::path& file, const toml::table& root) : file_(file), root_(root) {}

  void table(const char* name, const char*) {
    table_name_ = name;
    table_ = nullptr;
    keys_[name];
    const toml::node* node = root_.get(name);
    if (node == nullptr) return;
    table_ = node->as_table();
    if (table_ == nullptr) fail(*node, fmt::format("{} is a table; write [{}]", name, name));
  }

  template <typename T>
  void number(const char* key, T& value, double least, double most, const char*) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    if constexpr (std::is_floating_point_v<T>) {
      const auto given = node->value<double>();
      if (!node->is_number() || !given) fail(*node, fmt::format("{} is a number", name(key)));
      if (!(*given >= least && *given <= most)) out_of_range(*node, key, least, most);
      value = static_cast<T>(*given);
    } else {
      if (!node->is_integer()) fail(*node, fmt::format("{} is a whole number", name(key)));
      const std::int64_t given = *node->value<std::int64_t>();
      const auto high = std::min(most, static_cast<double>(std::numeric_limits<std::int64_t>::max() / 2));
      if (given < static_cast<std::int64_t>(least) || given > static_cast<std::int64_t>(high))
        out_of_range(*node, key, least, most);
      value = static_cast<T>(given);
    }
  }
  void flag(const char* key, bool& value, const char*) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    if (!node->is_boolean()) fail(*node, fmt::format("{} is true or false", name(key)));
    value = *node->value<bool>();
  }
  template <typename Enum>
  void choice(const char* key, Enum& value, const Names<Enum>& names, const char*) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    std::string all;
    for (const auto& [word, named] : names) {
      if (node->is_string() && *node->value<std::string_view>() == word) {
        value = named;
        return;
      }
      all += fmt::format("{}\"{}\"", all.empty() ? "" : ", ", word);
    }
    fail(*node, fmt::format("{} is one of {}", name(key), all));
  }

  /// What the file holds that nobody asked for.
  void refuse_unknown() const {
    for (const auto& [table_key, node] : root_) {
      const auto known = keys_.find(table_key.str());
      if (known == keys_.end())
        fail(table_key.source(),
             fmt::format("there is no table [{}]; see docs/examples/map.toml", table_key.str()));
      for (const auto& [key, value] : *node.as_table()) {
        if (known->second.find(key.str()) == known->second.end())
          fail(key.source(),
               fmt::format("there is no {}.{}; see docs/examples/map.toml", table_key.str(), key.str()));
      }
    }
  }

  /// Numbers that are in their ranges, but not together. Where the file has the key, its line is named.
  void require(bool holds, const char* table, const char* key, const std::string& sentence) const {
    if (holds) return;
    const toml::node_view<const toml::node> node = root_[table][key];
    if (node) fail(*node.node(), sentence);
    throw InputError(file_, sentence);
  }

 private:
  const toml::node* find(const char* key) {
    keys_[table_name_].insert(key);
    return table_ == nullptr ? nullptr : table_->get(key);
  }
  [[nodiscard]] std::string name(const char* key) const { return table_name_ + "." + key; }
  [[noreturn]] void out_of_range(const toml::node& node, const char* key, double least, double most) const {
    fail(node, fmt::format("{} must lie between {} and {}", name(key), least, most));
  }
  [[noreturn]] void fail(const toml::node& node, const std::string& sentence) const {
    fail(node.source(), sentence);
  }
  [[noreturn]] void fail(const toml::source_region& source, const std::string& sentence) const {
    throw InputError(file_, source.begin.line, sentence);
  }

  const std::filesystem::path& file_;
  const toml::table& root_;
  std::string table_name_;
  const toml::table* table_ = nullptr;
  std::map<std::string, std::set<std::string, std::less<>>, std::less<>> keys_;
};

toml::table parse(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw InputError(file, "is no file; give --config a TOML file");
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& error) {
    const std::string what(error.description());
    if (error.source().begin.line == 0) throw InputError(file, "cannot be read (" + what + ")");
    throw InputError(file, error.source().begin.line, "is no TOML: " + what);
  }
}

}  // namespace

MapperConfig default_settings(FrontEnd front_end) {
  MapperConfig config = front_end == FrontEnd::paper ? MapperConfig::paper() : MapperConfig::standard();
  config.scan_capacity = 0;
  config.pool_bytes = 0;
  config.voxel.cell_capacity = 32768;  // the fullest scan of HANNOVER1 has 19,538 cells of 10 cm
  return config;
}

void read_settings(const std::filesystem::path& file, MapperConfig& config) {
  const toml::table root = parse(file);
  TomlReader reader(file, root);
  visit_settings(config, reader);
  reader.refuse_unknown();
  reader.require(config.voxel.maximum_range_m > config.voxel.minimum_range_m, "voxel", "maximum_range_m",
                 "voxel.maximum_range_m must be larger than voxel.minimum_range_m");
  reader.require(config.detector.radius_cap_m >= config.detector.radius_m, "detector", "radius_cap_m",
                 "detector.radius_cap_m must be at least detector.radius_m");
  const std::uint32_t around_loop = 2 * config.scans_around_first + 1 + config.scans_before_last + 1;
  reader.require(
      around_loop <= Icp::maximum_model_scans, "loop_match", "scans_around_first",
      fmt::format("2 * loop_match.scans_around_first + loop_match.scans_before_last + 2 is {}, at most {} "
                  "scans are looked at together",
                  around_loop, Icp::maximum_model_scans));
  const std::uint32_t together = std::max(config.model_scans + 1, around_loop);
  reader.require(
      config.cache_slots >= together, "memory", "cache_slots",
      fmt::format("memory.cache_slots must be at least {}, as many scans are looked at together", together));
}

std::string to_toml(const MapperConfig& config) {
  TomlWriter writer;
  visit_settings(config, writer);
  return std::move(writer.text);
}

nlohmann::json to_json(const MapperConfig& config) {
  JsonWriter writer;
  visit_settings(config, writer);
  return std::move(writer.json);
}

}  // namespace alces::offline
