#include "text_file.h"

#include <fstream>
#include <iterator>

#include "alces_platform/settings/settings_error.h"

namespace alces::settings {
namespace {

constexpr std::size_t largest_bytes = std::size_t{1} << 20;

}  // namespace

std::string text_of(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw Error(file.string(), "is no file; give a TOML file, such as docs/examples has them");
  std::ifstream stream(file, std::ios::binary);
  std::string text(largest_bytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad() || (stream.fail() && !stream.eof())) throw Error(file.string(), "cannot be read");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > largest_bytes)
    throw Error(file.string(), "is larger than 1 MiB: that is no configuration");
  return text;
}

}  // namespace alces::settings
