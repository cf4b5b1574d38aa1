// Object dictionaries of real CiA 402 drives, after their EDS files: the communication profile (0x1000 to
// 0x1FFF) and the drive profile (0x6000 to 0x6FFF); of the manufacturers' own objects none. They differ as
// the real ones do:
//                       TMCM-1636                              EPOS4
//   error history       none (no 0x1003, no 0x603F)            0x1003 with 5 entries, 0x603F
//   0x60FF, 0x6040      mapped either way                      RPDO only (rww)
//   mapping             3 entries                              8 entries (the real one: 12)
//   ramps               0: not limited                         10000 rpm/s, at least 1
//   abort connection    none (no 0x6007)                       0x6007, quick stop
//   parameters          4 groups in 0x1010/0x1011              1 group
#pragma once

#include <cstdint>

#include "alces_platform/sim/object_dictionary.h"

namespace alces::sim {

[[nodiscard]] ObjectDictionary tmcm1636_objects(std::uint8_t node);
[[nodiscard]] ObjectDictionary epos4_objects(std::uint8_t node);

}  // namespace alces::sim
