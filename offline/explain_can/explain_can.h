// A CAN trace in words: CANopen (CiA 301) with drives (CiA 402), frame by frame, with memory: SDO answers are
// paired with their requests, PDOs are decoded through the mapping that the trace itself or the device's DCF
// tells, states are followed.
//
// A PDO's mapping and COB-ID are taken, in this order, from SDO transfers seen so far (until the node's
// communication is reset; a "save" keeps them), from the EDS or DCF, and, the COB-ID alone, from CiA 301's
// predefined connection set.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alces_drivers/can_frame.h"
#include "alces_platform/dictionary/object_dictionary_file.h"

namespace alces::offline {

enum class CanFrameMeaning : std::uint8_t {
  nmt,
  sync,
  time,
  emergency,
  tpdo,
  rpdo,
  sdo_request,
  sdo_response,
  boot_up,
  heartbeat,
  layer_setting,  ///< LSS, CiA 305
  remote,
  bus_error,    ///< the kernel's error frame
  not_canopen,  ///< 29-bit identifier or CAN FD
  unknown,
};
inline constexpr std::size_t can_frame_meaning_count = 15;
[[nodiscard]] const char* to_string(CanFrameMeaning meaning);

struct CanExplanation {
  CanFrameMeaning meaning = CanFrameMeaning::unknown;
  std::uint8_t node = 0;     ///< 0: none, or all
  bool is_abnormal = false;  ///< refusals, emergencies, faults, surprises: what one looks for in a trace
  std::string text;
};

/// One bus. Frames in the order they were on it.
class CanExplainer {
 public:
  /// `file` describes node `node`, or every node (none given and none in the file); nullptr: no file.
  explicit CanExplainer(std::shared_ptr<const ObjectDictionaryFile> file = nullptr,
                        std::optional<std::uint8_t> node = {});
  ~CanExplainer();
  CanExplainer(CanExplainer&&) noexcept;
  CanExplainer& operator=(CanExplainer&&) noexcept;

  [[nodiscard]] CanExplanation explain(const CanFrame& frame);

  /// What is still open when the trace ends: requests that were not answered.
  [[nodiscard]] std::vector<std::string> open_matters() const;

 private:
  struct Node;

  [[nodiscard]] Node& node(std::uint8_t number);
  [[nodiscard]] CanExplanation explain_nmt(const CanFrame& frame);
  [[nodiscard]] CanExplanation explain_time(const CanFrame& frame) const;
  [[nodiscard]] CanExplanation explain_emergency(const CanFrame& frame);
  [[nodiscard]] CanExplanation explain_sdo(const CanFrame& frame);
  [[nodiscard]] CanExplanation explain_heartbeat(const CanFrame& frame);
  [[nodiscard]] CanExplanation explain_remote(const CanFrame& frame);
  [[nodiscard]] std::optional<CanExplanation> explain_pdo(const CanFrame& frame);
  [[nodiscard]] CanExplanation decode_pdo(Node& node, std::uint16_t communication, const CanFrame& frame,
                                          bool is_off);
  void learn(Node& node, std::uint16_t index, std::uint8_t sub, std::int64_t value,
             CanExplanation& explanation);

  std::shared_ptr<const ObjectDictionaryFile> file_;
  std::optional<std::uint8_t> file_node_;
  std::map<std::uint8_t, std::unique_ptr<Node>> nodes_;
};

/// "181#2104", "00000123#R", "123##0DEAD": as candump -l writes a frame.
[[nodiscard]] std::string candump_text(const CanFrame& frame);

}  // namespace alces::offline
