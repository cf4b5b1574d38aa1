// One target as libFuzzer wants it; ALCES_FUZZ_NAME says which.
#include <cstddef>

#include "target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static alces::fuzz::Target* const target = alces::fuzz::find_target(ALCES_FUZZ_NAME);
  target->run({data, size});
  return 0;
}
