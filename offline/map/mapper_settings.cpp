#include "mapper_settings.h"

#include <fmt/format.h>

#include <type_traits>

#include "alces_platform/settings/mapper_keys.h"
#include "alces_platform/settings/mapper_settings.h"
#include "alces_platform/settings/settings_error.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

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
  static void retired(const char*) {}
  template <typename Enum>
  void choice(const char* key, const Enum& value, const settings::Names<Enum>& names, const char*) {
    for (const auto& [name, named] : names) {
      if (named == value) json[table_][key] = name;
    }
  }
  nlohmann::json json;

 private:
  std::string table_;
};

}  // namespace

MapperConfig default_settings(FrontEnd front_end) {
  MapperConfig config = settings::default_mapper_settings(
      front_end == FrontEnd::paper ? MapperConfig::paper() : MapperConfig::standard());
  config.voxel.cell_capacity = 0;
  return config;
}

void read_settings(const std::filesystem::path& file, MapperConfig& config) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw InputError(file, "is no file; give --config a TOML file");
  try {
    settings::read_mapper_settings(file, config);
  } catch (const settings::Error& error) {
    throw InputError(error.what());
  }
}

std::string to_toml(const MapperConfig& config) {
  return settings::to_toml(config);
}

nlohmann::json to_json(const MapperConfig& config) {
  JsonWriter writer;
  settings::visit_mapper(config, writer);
  return std::move(writer.json);
}

}  // namespace alces::offline
