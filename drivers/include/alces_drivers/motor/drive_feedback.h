// What a drive says of its shaft, a PDO at a time: what the encoder is told.
#pragma once

#include <cstdint>

#include "alces_drivers/stamp.h"

namespace alces {

struct DriveFeedback {
  std::int64_t stamp_ns = 0;                 ///< of the PDO with the position: when it came
  std::int64_t sync_stamp_ns = no_stamp_ns;  ///< when the last SYNC before it left, at which a drive in a
                                             ///< synchronous transmission type sampled; never: there was none
  bool is_extra =
      false;  ///< the second one since that SYNC: one of the two is a SYNC cycle older than it looks
  std::int32_t position_counts = 0;  ///< 0x6064, in the drive's unit; wraps round
  std::int32_t velocity_units = 0;   ///< 0x606C, of the same PDO or the last one that had it
  std::uint16_t statusword = 0;      ///< 0x6041, likewise
};

class DriveFeedbackSink {
 public:
  /// The stamps of successive calls rise, unless the clock was set back.
  virtual void on_drive_feedback(const DriveFeedback& feedback) = 0;

 protected:
  ~DriveFeedbackSink() = default;
};

}  // namespace alces
