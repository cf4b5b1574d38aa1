#include "checkpoint.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/output_file.h"

namespace alces::offline {
namespace {

using Json = nlohmann::json;
constexpr const char* checkpoint_magic = "alces lum checkpoint 1";

// FNV-1a: tells a damaged file, no more is asked of it.
std::uint64_t checksum(const std::vector<std::uint8_t>& bytes) {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001B3U;
  return hash;
}

}  // namespace

void write_checkpoint(const std::filesystem::path& file, const LumState& state,
                      const std::string& fingerprint) {
  Json json = {{"settings", fingerprint},
               {"iterations", state.iterations},
               {"distance_limit_m", state.distance_limit_m},
               {"is_converged", state.is_converged},
               {"links", Json::array()},
               {"poses", Json::array()}};
  for (const ScanLink& link : state.links) {
    json["links"].push_back(link.j);
    json["links"].push_back(link.k);
  }
  for (const Pose& pose : state.map_from_scan) {
    for (Eigen::Index i = 0; i < 3; ++i) json["poses"].push_back(pose.translation_m[i]);
    for (Eigen::Index i = 0; i < 4; ++i) json["poses"].push_back(pose.rotation.coeffs()[i]);
  }
  const std::vector<std::uint8_t> body = Json::to_cbor(json);  // numbers to the last bit
  OutputFile output(file);
  output.write(fmt::format("{} {:016x}\n", checkpoint_magic, checksum(body)));
  output.write({reinterpret_cast<const char*>(body.data()), body.size()});
  output.commit();
}

LumState read_checkpoint(const std::filesystem::path& file, std::size_t poses,
                         const std::string& fingerprint) {
  std::string bytes;
  read_file(file, bytes);
  const std::size_t line = bytes.find('\n');
  const std::vector<std::uint8_t> body(
      bytes.begin() + static_cast<std::ptrdiff_t>(line == std::string::npos ? bytes.size() : line + 1),
      bytes.end());
  if (line == std::string::npos ||
      bytes.substr(0, line) != fmt::format("{} {:016x}", checkpoint_magic, checksum(body)))
    throw InputError(file, "is damaged, or no checkpoint of this version; start again without --resume");
  LumState state;
  try {
    const Json json = Json::from_cbor(body);
    if (json.at("settings").get<std::string>() != fingerprint)
      throw InputError(file, "was made with other settings; give the same, or start again without --resume");
    const auto numbers = json.at("poses").get<std::vector<double>>();
    if (numbers.size() != 7 * poses)
      throw InputError(file,
                       fmt::format("holds {} poses, the map {}; it is of another map, start again without "
                                   "--resume",
                                   numbers.size() / 7, poses));
    for (std::size_t i = 0; i < poses; ++i) {
      Pose pose;
      for (std::size_t n = 0; n < 3; ++n)
        pose.translation_m[static_cast<Eigen::Index>(n)] = numbers[7 * i + n];
      for (std::size_t n = 0; n < 4; ++n)
        pose.rotation.coeffs()[static_cast<Eigen::Index>(n)] = numbers[7 * i + 3 + n];
      if (!is_valid(pose))
        throw InputError(file, fmt::format("pose {} is none; start again without --resume", i));
      state.map_from_scan.push_back(pose);
    }
    const auto links = json.at("links").get<std::vector<std::uint32_t>>();
    for (std::size_t i = 0; i + 1 < links.size(); i += 2) {
      if (links[i] >= poses || links[i + 1] >= links[i])
        throw InputError(file, "links scans that the map does not have; start again without --resume");
      state.links.push_back({links[i], links[i + 1]});
    }
    state.iterations = json.at("iterations").get<std::uint32_t>();
    state.distance_limit_m = json.at("distance_limit_m").get<float>();
    state.is_converged = json.at("is_converged").get<bool>();
  } catch (const Json::exception& error) {
    throw InputError(file, fmt::format("is damaged ({}); start again without --resume", error.what()));
  }
  return state;
}

}  // namespace alces::offline
