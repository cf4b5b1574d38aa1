// Does a [motor] table suit the drive? Held against the drive's own EDS or DCF file, before anything turns:
//
//   - each object that a bring-up reads or writes is there, may be read or written, and has that size;
//   - what travels in PDOs may be mapped, in that direction, with that many bits, and a mapping that is kept
//     is the one that the table says;
//   - the drive has what it needs to stop when nobody commands it (0x1016, 0x6007, 0x1029; master_loss.h).
//
// An EDS says what a drive ought to have; what it really has is found out at bring-up.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alces_drivers/motor/motor_config.h"
#include "alces_platform/dictionary/object_dictionary_file.h"

namespace alces {

struct MotorFinding {
  bool is_error = false;  ///< a bring-up would fail; else a warning
  std::string sentence;   ///< "vehicle.toml:12: motor.writes: 0x6502:00 (...) ... (drive.eds:341)"
};

/// `configuration` is the file that the motor was read from and `text` its content, for the lines;
/// `dictionary` is the content of the file `dcf`.
[[nodiscard]] std::vector<MotorFinding> check_motor(const MotorConfig& motor,
                                                    const std::filesystem::path& configuration,
                                                    std::string_view text,
                                                    const ObjectDictionaryFile& dictionary,
                                                    const std::filesystem::path& dcf);

}  // namespace alces
