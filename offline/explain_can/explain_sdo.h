// One SDO channel (a client and one node) in words: requests and answers paired, segments and blocks counted
// and put together (CiA 301, SDO protocols).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canopen_objects.h"

namespace alces::offline {

struct SdoTransfer {
  bool is_write = false;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::vector<std::uint8_t> bytes;
};

struct SdoWords {
  std::string text;
  bool is_abnormal = false;
  std::optional<SdoTransfer> done = {};  ///< the transfer that this frame completes
};

class SdoConversation {
 public:
  explicit SdoConversation(const CanopenObjects& objects) : objects_(&objects) {}

  [[nodiscard]] SdoWords on_request(ObjectBytes bytes);
  [[nodiscard]] SdoWords on_response(ObjectBytes bytes, std::optional<int> mode);

  /// What was asked and not answered, e.g. "read 0x6041 Statusword".
  [[nodiscard]] std::optional<std::string> unanswered() const;
  /// The node restarted: nothing is open any more.
  void reset() { *this = SdoConversation(*objects_); }

 private:
  enum class Phase : std::uint8_t {
    idle,
    asked,
    segments,
    block_started,
    block_segments,
    block_acknowledge,
    block_end
  };

  [[nodiscard]] std::string title() const { return objects_->title(transfer_.index, transfer_.sub); }
  [[nodiscard]] std::string doing() const { return (transfer_.is_write ? "write " : "read ") + title(); }
  void begin(bool is_write, ObjectBytes bytes);
  [[nodiscard]] SdoWords segment(ObjectBytes bytes, const char* verb);
  [[nodiscard]] SdoWords aborted(ObjectBytes bytes, const char* by);
  [[nodiscard]] SdoWords completed(std::optional<int> mode);
  [[nodiscard]] SdoWords block_segment(ObjectBytes bytes);
  [[nodiscard]] SdoWords on_block_request(ObjectBytes bytes);
  [[nodiscard]] SdoWords on_block_answer(ObjectBytes bytes);

  const CanopenObjects* objects_;
  Phase phase_ = Phase::idle;
  bool is_waiting_ = false;  ///< for the node's answer
  bool is_block_ = false;
  bool last_segment_came_ = false;
  bool next_toggle_ = false;
  unsigned block_size_ = 0;
  SdoTransfer transfer_;
};

}  // namespace alces::offline
