#include "alces_offline/number_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "alces_offline/error.h"
#include "alces_offline/input_file.h"
#include "alces_offline/text_numbers.h"

namespace alces::offline {

NumberTable NumberTable::read(const std::filesystem::path& file) {
  std::string bytes;
  read_file(file, bytes);
  NumberTable table;
  const char* at = bytes.data();
  const char* const end = at + bytes.size();
  for (std::size_t line = 1; at < end; ++line) {
    const std::size_t begin = table.numbers_.size();
    while (at < end && *at != '\n') {
      if (is_blank(*at) || *at == ',' || *at == ';') {
        ++at;
      } else if (*at == '#' || *at == '%') {
        at = std::find(at, end, '\n');
      } else {
        double value = 0;
        const char* const next = parse_number(at, end, value);
        if (next == nullptr) {
          const char* const stop = std::find_if(at, end, ends_number);
          const std::string_view text(at, std::min<std::size_t>(static_cast<std::size_t>(stop - at), 40));
          throw InputError(file, line,
                           fmt::format("\"{}\" is no number; only numbers and # comments belong here", text));
        }
        table.numbers_.push_back(value);
        at = next;
      }
    }
    if (at < end) ++at;
    if (table.numbers_.size() > begin) {
      table.begins_.push_back(table.numbers_.size());
      table.lines_.push_back(line);
    }
  }
  return table;
}

}  // namespace alces::offline
