// A row of docs/faults.md and the scanner that suffers it: what the document says is reported and how soon it
// is over is what is checked here, word for word.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "support/scanner_harness.h"

namespace alces {

class FaultBench {
 public:
  /// Devices that can go on while another one fails.
  enum Device : unsigned { drive = 1, index = 2, laser = 4, odometry = 8, gps = 16, all = 31 };

  /// `row` is the row's first cell. The scanner is brought up, and has run for three turns of the head.
  explicit FaultBench(const std::string& row, const HarnessSettings& settings = harness_settings());

  /// The fault begins now; what happens within `duration_s` is what goes_on() looks at.
  void suffer(sim::Fault fault, double duration_s, std::int64_t argument = 0);
  /// The same for a fault that the test has begun by itself.
  void endure(double duration_s);

  /// A notice was raised since the fault began, and the row's second cell holds `source: text`.
  void is_told(std::string_view source, std::string_view text);
  /// Nothing but info was told since the fault began, as the row says: "no notice".
  void nobody_is_told();
  /// A counter rose since the fault began, and the row's second cell holds `part.name`.
  void is_counted(ScannerPart part, std::string_view name, std::uint64_t at_least = 1);
  /// These delivered at their rates while the fault lasted.
  void goes_on(unsigned devices);
  /// Two whole scans in a row within the limit, counted from now, and the row's fourth cell holds "within N
  /// s".
  void is_whole_again(int limit_s);
  /// While the fault lasted the encoder's angle was never farther than that from the shaft's, and the row's
  /// third cell holds "the angle within N deg".
  void angle_is_true(const std::string& within_deg);
  /// No scan since the fault began is incomplete, and scans came.
  void scans_go_on();
  /// Motor at speed, all lasers measure, every profile, ray and event is accounted for and recorded. The last
  /// call.
  void all_is_well();

  ScannerHarness harness;

 private:
  [[nodiscard]] std::uint64_t& counter_before(ScannerPart part, std::string_view name);

  std::string reported_;
  std::string recovers_;
  std::vector<std::uint64_t> counters_before_;
  std::size_t notices_before_ = 0;
  std::size_t scans_before_ = 0;
  ScannerHarness::Delivery delivery_before_;
  ScannerHarness::Delivery delivery_;
  double first_angle_rad_;
  std::string goes_on_;
  double duration_s_ = 0;
  double worst_angle_rad_ = 0;
  std::size_t angles_ = 0;
};

/// The cells of docs/faults.md, row by row.
[[nodiscard]] const std::vector<std::vector<std::string>>& fault_table();

}  // namespace alces
