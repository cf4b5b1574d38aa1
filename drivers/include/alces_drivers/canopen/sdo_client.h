// Reads and writes one node's objects, one transfer at a time: expedited up to 4 bytes, segmented above. CiA
// 301 version 4.2, 7.2.4.
//
// A request that is not answered in time is aborted and the whole transfer begun again, `retry_limit` times.
// A segment whose toggle bit does not alternate ends the transfer, with abort code 0503 0000h. Whatever else
// is not the answer that is awaited (late, repeated, of another object) is counted and changes nothing. One
// thing cannot be told apart, because SDO answers have no number: the late answer to a request from the
// answer to its repetition.
//
// Memory: about 0.5 KiB.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/canopen/object.h"
#include "alces_drivers/canopen/sdo_message.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/stamp.h"

namespace alces::canopen {

struct SdoTiming {
  std::int64_t response_timeout_ns =
      300 * ns_per_ms;           ///< from the request to its answer; of each segment too
  std::uint8_t retry_limit = 2;  ///< transfers after the first; 0: none
};

enum class SdoStatus : std::uint8_t {
  idle,           ///< no transfer was begun yet, or it was cancelled
  busy,           ///< on_frame() and on_tick() bring it further
  done,           ///< of an upload: bytes() and value()
  aborted,        ///< by the node: abort_code()
  timed_out,      ///< no answer, retries included
  not_sent,       ///< the port did not take the request, retries included
  too_large,      ///< more than maximum_bytes came or were announced; aborted by us
  size_mismatch,  ///< fewer or more bytes than announced came; aborted by us
  bad_toggle,     ///< a segment's toggle bit did not alternate; aborted by us
};
[[nodiscard]] const char* to_string(SdoStatus status);

class SdoClient {
 public:
  static constexpr std::uint32_t maximum_bytes = 256;

  struct Counters {
    std::uint64_t transfers = 0;  ///< begun
    std::uint64_t retries = 0;
    std::uint64_t timeouts = 0;            ///< requests without an answer
    std::uint64_t aborts_received = 0;     ///< that ended a transfer
    std::uint64_t requests_not_taken = 0;  ///< the port's queue was full; tried again
    std::uint64_t answers_late = 0;        ///< while no transfer was under way
    std::uint64_t answers_foreign = 0;     ///< of another object than the one asked for
    std::uint64_t answers_repeated = 0;    ///< segments with the toggle bit of the one before; aborted
    std::uint64_t answers_unexpected = 0;  ///< to another kind of request
    std::uint64_t answers_malformed = 0;   ///< not 8 bytes, or no known command specifier

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("sdo_transfers", transfers);
      visit("sdo_retries", retries);
      visit("sdo_timeouts", timeouts);
      visit("sdo_aborts_received", aborts_received);
      visit("sdo_requests_not_taken", requests_not_taken);
      visit("sdo_answers_late", answers_late);
      visit("sdo_answers_foreign", answers_foreign);
      visit("sdo_answers_repeated", answers_repeated);
      visit("sdo_answers_unexpected", answers_unexpected);
      visit("sdo_answers_malformed", answers_malformed);
    }
  };

  SdoClient(std::uint8_t node, const SdoTiming& timing, CanPort& port);

  /// Begins to write; the bytes are copied. False: a transfer is under way, or the size is 0 or above
  /// maximum_bytes.
  [[nodiscard]] bool download(ObjectAddress object, std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  [[nodiscard]] bool download(const ObjectWrite& write, std::int64_t now_ns);
  /// Begins to read. False: a transfer is under way.
  [[nodiscard]] bool upload(ObjectAddress object, std::int64_t now_ns);
  /// Aborts the transfer under way, if any (0800 0000h); what still comes of it counts as late.
  void cancel();

  /// Any frame; those that are not this node's SDO answers are none of its business. True: it was one.
  bool on_frame(const CanFrame& frame, std::int64_t stamp_ns);
  void on_tick(std::int64_t now_ns);

  [[nodiscard]] SdoStatus status() const { return status_; }
  [[nodiscard]] bool is_busy() const { return status_ == SdoStatus::busy; }
  /// Of the transfer begun last.
  [[nodiscard]] ObjectAddress object() const { return object_; }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {buffer_.data(), size_}; }
  [[nodiscard]] std::uint32_t value() const;                              ///< the first 4 bytes at most
  [[nodiscard]] std::uint32_t abort_code() const { return abort_code_; }  ///< 0: none
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  enum class Phase : std::uint8_t { initiate_download, download_segment, initiate_upload, upload_segment };

  void begin(Phase phase, ObjectAddress object, std::int64_t now_ns);
  void initiate(std::int64_t now_ns);
  void ask(const CanFrame& request, std::int64_t now_ns);
  void ask_next_segment(std::int64_t now_ns);
  void finish(SdoStatus status) { status_ = status; }
  void give_up(SdoStatus status, std::uint32_t abort_code);
  void on_response(const SdoMessage& answer, std::int64_t stamp_ns);
  void on_upload_response(const SdoMessage& answer, std::int64_t stamp_ns);
  void on_upload_segment(const SdoMessage& answer, std::int64_t stamp_ns);
  [[nodiscard]] bool append(std::span<const std::uint8_t> bytes);

  std::uint8_t node_;
  SdoTiming timing_;
  CanPort& port_;
  SdoStatus status_ = SdoStatus::idle;
  bool is_download_ = false;
  Phase phase_ = Phase::initiate_upload;
  ObjectAddress object_;
  CanFrame request_;
  bool is_sent_ = false;
  std::int64_t deadline_ns_ = no_stamp_ns;
  std::uint8_t retries_left_ = 0;
  bool toggle_ = false;
  std::uint32_t size_ = 0;       ///< bytes in the buffer
  std::uint32_t offset_ = 0;     ///< of a download: bytes that were acknowledged
  std::uint32_t in_flight_ = 0;  ///< of a download: bytes in the segment that was sent
  bool has_total_ = false;       ///< of an upload
  std::uint32_t total_bytes_ = 0;
  std::uint32_t abort_code_ = 0;
  std::array<std::uint8_t, maximum_bytes> buffer_{};
  Counters counters_;
};

}  // namespace alces::canopen
