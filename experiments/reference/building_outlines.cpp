#include "building_outlines.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "alces/kd_tree.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"

namespace alces::offline {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr double farthest_m = 100'000;
constexpr double highest_m = 1'000;

/// Why a building is none; empty when it is one.
std::string fault_of(const Building& building) {
  if (!(building.height_m > 0) || building.height_m > highest_m)
    return fmt::format("a height of {} m", building.height_m);
  if (!(std::abs(building.base_m) < 10 * highest_m)) return fmt::format("a base of {} m", building.base_m);
  if (building.rings.empty()) return "no outline";
  for (const auto& ring : building.rings) {
    if (ring.size() < 3) return fmt::format("an outline of {} corners; three are the least", ring.size());
    for (const Eigen::Vector2d& corner : ring)
      if (!(corner.cwiseAbs().maxCoeff() < farthest_m))
        return fmt::format(
            "a corner at ({}, {}), more than 100 km from the origin; subtract a round offset from "
            "outlines and cloud",
            corner.x(), corner.y());
  }
  return "";
}

void drop_repeated_end(std::vector<Eigen::Vector2d>& ring) {
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
}

std::vector<Building> read_text(const fs::path& file, const std::string& bytes) {
  std::vector<Building> buildings;
  std::vector<std::size_t> lines;
  std::istringstream text(bytes);
  std::size_t number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    if (const std::size_t comment = line.find('#'); comment != std::string::npos) line.erase(comment);
    std::istringstream words(line);
    std::string first;
    if (!(words >> first)) continue;
    if (first == "building") {
      Building building;
      if (!(words >> building.height_m))
        throw InputError(file, number, "a building needs its height: building HEIGHT_M [BASE_M]");
      if (!(words >> std::ws).eof() && !(words >> building.base_m))
        throw InputError(file, number, "the base is no number: building HEIGHT_M [BASE_M]");
      building.rings.emplace_back();
      buildings.push_back(std::move(building));
      lines.push_back(number);
      continue;
    }
    if (buildings.empty())
      throw InputError(file, number, "a corner before the first building; begin with: building HEIGHT_M");
    Eigen::Vector2d corner;
    std::istringstream numbers(line);
    std::string rest;
    if (!(numbers >> corner.x() >> corner.y()) || (numbers >> rest))
      throw InputError(file, number, "a corner is two numbers, x and y in metres");
    buildings.back().rings.front().push_back(corner);
  }
  for (std::size_t i = 0; i < buildings.size(); ++i) {
    drop_repeated_end(buildings[i].rings.front());
    if (const std::string fault = fault_of(buildings[i]); !fault.empty())
      throw InputError(file, lines[i], "this building has " + fault);
  }
  return buildings;
}

class GeoJsonReader {
 public:
  GeoJsonReader(const fs::path& file, std::optional<double> default_height_m)
      : file_(file), default_height_m_(default_height_m) {}

  std::vector<Building> read(const Json& json) {
    const std::string type = type_of(json);
    if (type == "FeatureCollection") {
      for (const Json& feature : array_in(json, "features")) add_feature(feature);
    } else if (type == "Feature") {
      add_feature(json);
    } else {
      add_geometry(json, Json::object());
    }
    return std::move(buildings_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(file_, fmt::format("feature {}: {}", feature_, what));
  }
  [[nodiscard]] std::string type_of(const Json& json) const {
    if (!json.is_object() || !json.contains("type") || !json["type"].is_string()) refuse("has no type");
    return json["type"].get<std::string>();
  }
  [[nodiscard]] const Json& array_in(const Json& json, const char* key) const {
    if (!json.is_object() || !json.contains(key) || !json[key].is_array())
      refuse(fmt::format("has no list of {}", key));
    return json[key];
  }
  [[nodiscard]] std::optional<double> number_in(const Json& properties, const char* key) const {
    if (!properties.is_object() || !properties.contains(key) || properties[key].is_null())
      return std::nullopt;
    if (!properties[key].is_number()) refuse(fmt::format("its {} is no number", key));
    return properties[key].get<double>();
  }

  void add_feature(const Json& feature) {
    ++feature_;
    if (type_of(feature) != "Feature" || !feature.contains("geometry"))
      refuse("is no Feature with a geometry");
    add_geometry(feature["geometry"],
                 feature.contains("properties") ? feature["properties"] : Json::object());
  }
  void add_geometry(const Json& geometry, const Json& properties) {
    const std::string type = type_of(geometry);
    if (type == "Polygon") {
      add_polygon(array_in(geometry, "coordinates"), properties);
    } else if (type == "MultiPolygon") {
      for (const Json& polygon : array_in(geometry, "coordinates")) add_polygon(polygon, properties);
    } else {
      refuse(fmt::format("a {} is no outline of a building; Polygon and MultiPolygon are", type));
    }
  }
  void add_polygon(const Json& rings, const Json& properties) {
    Building building;
    const std::optional<double> height_m = number_in(properties, "height");
    if (!height_m && !default_height_m_) refuse("has no property \"height\"; add it, or give --height");
    building.height_m = height_m ? *height_m : *default_height_m_;
    building.base_m = number_in(properties, "base").value_or(0);
    if (!rings.is_array()) refuse("its coordinates are no rings");
    for (const Json& ring : rings) {
      std::vector<Eigen::Vector2d> corners;
      if (!ring.is_array()) refuse("its coordinates are no rings");
      for (const Json& corner : ring) {
        if (!corner.is_array() || corner.size() < 2 || !corner[0].is_number() || !corner[1].is_number())
          refuse("a corner is not [x, y]");
        corners.emplace_back(corner[0].get<double>(), corner[1].get<double>());
      }
      drop_repeated_end(corners);
      building.rings.push_back(std::move(corners));
    }
    if (const std::string fault = fault_of(building); !fault.empty()) refuse("has " + fault);
    buildings_.push_back(std::move(building));
  }

  const fs::path& file_;
  std::optional<double> default_height_m_;
  std::size_t feature_ = 0;
  std::vector<Building> buildings_;
};

}  // namespace

std::vector<Building> read_building_outlines(const fs::path& file, std::optional<double> default_height_m) {
  std::string bytes;
  read_file(file, bytes);
  std::vector<Building> buildings;
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && bytes[first] == '{') {
    Json json;
    try {
      json = Json::parse(bytes);
    } catch (const Json::exception& error) {
      throw InputError(file, std::string("is no GeoJSON (") + error.what() + ")");
    }
    buildings = GeoJsonReader(file, default_height_m).read(json);
  } else {
    buildings = read_text(file, bytes);
  }
  if (buildings.empty())
    throw InputError(file,
                     "holds no building; GeoJSON, or text: building HEIGHT_M, then a corner x y a line");
  return buildings;
}

std::vector<Point> extrude_walls(std::span<const Building> buildings, double spacing_m) {
  std::vector<Point> points;
  for (const Building& building : buildings) {
    const double rows = std::ceil(building.height_m / spacing_m);
    for (const auto& ring : building.rings) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Eigen::Vector2d& from = ring[i];
        const Eigen::Vector2d along = ring[(i + 1) % ring.size()] - from;
        const double columns = std::max(1.0, std::ceil(along.norm() / spacing_m));
        if ((rows + 1) * columns + static_cast<double>(points.size()) > KdTree::maximum_points)
          throw CapacityError(
              fmt::format("the walls have more than {} points at {} m spacing; give a wider "
                          "--spacing",
                          KdTree::maximum_points, spacing_m));
        for (double column = 0; column < columns; ++column) {  // the far corner is the next wall's
          const Eigen::Vector2d foot = from + column / columns * along;
          for (double row = 0; row <= rows; ++row)
            points.push_back({static_cast<float>(foot.x()), static_cast<float>(foot.y()),
                              static_cast<float>(building.base_m + row / rows * building.height_m)});
        }
      }
    }
  }
  return points;
}

}  // namespace alces::offline
