// Object dictionaries of real CiA 402 drives, after their EDS files or manuals: the communication profile
// (0x1000 to 0x1FFF) and the drive profile (0x6000 to 0x6FFF); of the manufacturers' own objects none. They
// differ as the real ones do:
//                       TMCM-1636                  EPOS4                            iPOS
//   source              EDS, a recorded bring-up   EDS                              manual
//   error history       none                       0x1003 with 5 entries, 0x603F    0x603F
//   0x60FF, 0x6040      mapped either way          RPDO only (rww)                  RPDO only
//   mapping             3 entries                  8 entries (the real one: 12)     8 entries
//   ramps               0: not limited             10000 rpm/s, at least 1          no 0x6084
//   parameters          4 groups in 0x1010/0x1011  1 group                          1 group
//
// And without a master, when the heartbeat that 0x1016 watches stays away:
//   abort connection    none (no 0x6007)           0x6007, quick stop               0x6007, fault
//   what follows        EMCY 0x8130, pre-operational (0x1029); then the shaft stops as 0x6007 says. Where
//                       there is none it turns on: what a real TMCM-1636 does is not known, so this is the
//                       worst that it can be.
#pragma once

#include <cstdint>

#include "alces_platform/sim/motor/object_dictionary.h"

namespace alces::sim {

[[nodiscard]] ObjectDictionary tmcm1636_objects(std::uint8_t node);
[[nodiscard]] ObjectDictionary epos4_objects(std::uint8_t node);
[[nodiscard]] ObjectDictionary ipos_objects(std::uint8_t node);

}  // namespace alces::sim
