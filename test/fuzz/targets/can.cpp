// CAN in words: a device's dictionary (EDS, DCF), candump's text, what frames mean.
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "../memory_file.h"
#include "alces_platform/dictionary/object_dictionary_file.h"
#include "offline/explain_can/candump_lines.h"
#include "offline/explain_can/explain_can.h"
#include "offline/io/files/error.h"

namespace alces::fuzz {
namespace {

ALCES_FUZZ_TARGET(eds) {
  try {
    const ObjectDictionaryFile file = ObjectDictionaryFile::parse(as_text(bytes), "motor.eds");
    for (const std::uint16_t index :
         std::array<std::uint16_t, 6>{0x1000, 0x1016, 0x1018, 0x1a00, 0x6040, 0x6007}) {
      (void)file.name(index);
      for (const std::uint8_t sub : std::array<std::uint8_t, 4>{0, 1, 2, 255})
        (void)file.value(index, sub, 127);
    }
    (void)file.node();
  } catch (const DictionaryError&) {
  }
}

/// A trace and, before it, the dictionary it is explained by.
ALCES_FUZZ_TARGET(explain_can) {
  std::shared_ptr<const ObjectDictionaryFile> dictionary;
  for_each_file(bytes, {"motor.eds"}, [&](std::string_view, std::string_view content) {
    try {
      dictionary =
          std::make_shared<const ObjectDictionaryFile>(ObjectDictionaryFile::parse(content, "motor.eds"));
    } catch (const DictionaryError&) {
    }
  });
  for_each_file(bytes, {"candump.log"}, [&](std::string_view, std::string_view content) {
    const MemoryFile file({reinterpret_cast<const std::uint8_t*>(content.data()), content.size()});
    offline::CanExplainer explainer(dictionary);
    try {
      (void)offline::read_candump(file.path(), [&](const offline::CandumpLine& line) {
        require(!offline::candump_text(line.frame).empty(), "every frame can be written");
        require(!explainer.explain(line.frame).text.empty(), "every frame has words");
      });
    } catch (const offline::InputError&) {
    }
    (void)explainer.open_matters();
  });
}

}  // namespace
}  // namespace alces::fuzz
