#include "explain_sdo.h"

#include <fmt/core.h>

#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/canopen/sdo_abort.h"

namespace alces::offline {
namespace {

// Command specifiers, the upper three bits of the first byte.
constexpr unsigned download_segment_request = 0;
constexpr unsigned download_request = 1;
constexpr unsigned upload_request = 2;
constexpr unsigned upload_segment_request = 3;
constexpr unsigned abort_transfer = 4;
constexpr unsigned block_upload_request = 5;
constexpr unsigned block_download_request = 6;

constexpr unsigned upload_segment_response = 0;
constexpr unsigned download_segment_response = 1;
constexpr unsigned upload_response = 2;
constexpr unsigned download_response = 3;
constexpr unsigned block_download_answer = 5;
constexpr unsigned block_upload_answer = 6;

std::uint32_t unsigned32(ObjectBytes bytes) {
  return static_cast<std::uint32_t>(object_number(bytes, 0));
}

}  // namespace

std::optional<std::string> SdoConversation::unanswered() const {
  if (!is_waiting_) return std::nullopt;
  return doing();
}

void SdoConversation::begin(bool is_write, ObjectBytes bytes) {
  transfer_ = {is_write, static_cast<std::uint16_t>(bytes[1] | bytes[2] << 8), bytes[3], {}};
  phase_ = Phase::asked;
  is_waiting_ = true;
  is_block_ = false;
  next_toggle_ = false;
  last_segment_came_ = false;
}

SdoWords SdoConversation::aborted(ObjectBytes bytes, const char* by) {
  const auto index = static_cast<std::uint16_t>(bytes[1] | bytes[2] << 8);
  const std::uint32_t code = unsigned32(bytes.subspan(4, 4));
  phase_ = Phase::idle;
  is_waiting_ = false;
  return {fmt::format("{}aborts {}: 0x{:08X}, {}", by, objects_->title(index, bytes[3]), code,
                      canopen::sdo_abort_text(code)),
          true};
}

SdoWords SdoConversation::completed(std::optional<int> mode) {
  phase_ = Phase::idle;
  is_waiting_ = false;
  SdoWords words;
  words.text = fmt::format("{} {} {}", title(), transfer_.is_write ? "written:" : "=",
                           objects_->words(transfer_.index, transfer_.sub, transfer_.bytes, mode));
  words.done = transfer_;
  return words;
}

SdoWords SdoConversation::segment(ObjectBytes bytes, const char* verb) {
  const bool toggle = (bytes[0] & 0x10) != 0;
  const std::size_t size = 7 - ((bytes[0] >> 1) & 7U);
  last_segment_came_ = (bytes[0] & 1) != 0;
  transfer_.bytes.insert(transfer_.bytes.end(), bytes.begin() + 1,
                         bytes.begin() + 1 + static_cast<std::ptrdiff_t>(size));
  return {fmt::format("{} of {}: segment of {} bytes, {} so far{}{}", verb, title(), size,
                      transfer_.bytes.size(), last_segment_came_ ? ", the last" : "",
                      toggle != next_toggle_ ? "; its toggle bit is wrong" : ""),
          toggle != next_toggle_};
}

SdoWords SdoConversation::on_request(ObjectBytes bytes) {
  if (bytes.size() != 8) return {fmt::format("{} bytes, 8 are needed", bytes.size()), true};
  if (phase_ == Phase::block_segments && is_block_ && transfer_.is_write && bytes[0] != 0x80)
    return block_segment(bytes);
  const std::optional<std::string> open = unanswered();
  const auto with_open = [&](SdoWords words) {
    if (open) {
      words.text += fmt::format(" (the node has not answered: {})", *open);
      words.is_abnormal = true;
    }
    return words;
  };
  switch (bytes[0] >> 5) {
    case download_request: {
      begin(true, bytes);
      const bool is_expedited = (bytes[0] & 2) != 0;
      const bool has_size = (bytes[0] & 1) != 0;
      if (is_expedited) {
        const std::size_t size = has_size ? 4 - ((bytes[0] >> 2) & 3U) : 4;
        const ObjectBytes data = bytes.subspan(4, size);
        transfer_.bytes.assign(data.begin(), data.end());
        return with_open(
            {fmt::format("write {} = {}", title(), objects_->words(transfer_.index, transfer_.sub, data))});
      }
      return with_open({fmt::format("write {} in segments, {}", title(),
                                    has_size ? fmt::format("{} bytes", unsigned32(bytes.subspan(4, 4)))
                                             : std::string("length not told"))});
    }
    case upload_request:
      begin(false, bytes);
      return with_open({doing()});
    case download_segment_request:
    case upload_segment_request: {
      const bool is_write = bytes[0] >> 5 == download_segment_request;
      if (phase_ != Phase::segments || transfer_.is_write != is_write)
        return {"segment of a transfer that was not seen", true};
      is_waiting_ = true;
      if (is_write) return with_open(segment(bytes, "write"));
      const bool toggle = (bytes[0] & 0x10) != 0;
      return with_open({fmt::format("next segment of {}{}", title(),
                                    toggle != next_toggle_ ? "; its toggle bit is wrong" : ""),
                        toggle != next_toggle_});
    }
    case abort_transfer:
      return aborted(bytes, "the client ");
    case block_upload_request:
    case block_download_request:
      return with_open(on_block_request(bytes));
    default:
      return {fmt::format("unknown command 0x{:02X}", bytes[0]), true};
  }
}

SdoWords SdoConversation::on_response(ObjectBytes bytes, std::optional<int> mode) {
  if (bytes.size() != 8) return {fmt::format("{} bytes, 8 are needed", bytes.size()), true};
  const bool is_block_data = phase_ == Phase::block_segments && is_block_ && !transfer_.is_write;
  if (is_block_data && bytes[0] != 0x80) return block_segment(bytes);
  const unsigned command = bytes[0] >> 5;
  if (command == abort_transfer) return aborted(bytes, "");
  const bool was_waiting = is_waiting_;
  is_waiting_ = false;
  if (command == upload_response || command == download_response) {
    const auto index = static_cast<std::uint16_t>(bytes[1] | bytes[2] << 8);
    const bool is_write = command == download_response;
    const bool fits = was_waiting && phase_ == Phase::asked && transfer_.is_write == is_write &&
                      transfer_.index == index && transfer_.sub == bytes[3];
    if (!fits) {
      const std::optional<std::string> asked = was_waiting ? std::optional(doing()) : std::nullopt;
      begin(is_write, bytes);
      is_waiting_ = false;
      phase_ = Phase::idle;
      std::string what = is_write ? title() + " written" : title();
      if (!is_write && (bytes[0] & 2) != 0) {
        const std::size_t size = (bytes[0] & 1) != 0 ? 4 - ((bytes[0] >> 2) & 3U) : 4;
        what += " = " + objects_->words(index, bytes[3], bytes.subspan(4, size), mode);
      }
      return {what + (asked ? fmt::format(" (but asked was: {})", *asked) : " (no request was seen)"), true};
    }
    if (is_write && !transfer_.bytes.empty()) return completed(mode);
    if (is_write) {
      phase_ = Phase::segments;
      return {fmt::format("{} may be written in segments", title())};
    }
    if ((bytes[0] & 2) != 0) {
      const std::size_t size = (bytes[0] & 1) != 0 ? 4 - ((bytes[0] >> 2) & 3U) : 4;
      transfer_.bytes.assign(bytes.begin() + 4, bytes.begin() + 4 + static_cast<std::ptrdiff_t>(size));
      return completed(mode);
    }
    phase_ = Phase::segments;
    return {fmt::format("{} comes in segments, {}", title(),
                        (bytes[0] & 1) != 0 ? fmt::format("{} bytes", unsigned32(bytes.subspan(4, 4)))
                                            : std::string("length not told"))};
  }
  if (command == upload_segment_response || command == download_segment_response) {
    const bool is_write = command == download_segment_response;
    if (phase_ != Phase::segments || transfer_.is_write != is_write)
      return {"segment of a transfer that was not seen", true};
    SdoWords words;
    if (is_write) {
      const bool is_wrong = ((bytes[0] & 0x10) != 0) != next_toggle_;
      words = {fmt::format("segment of {} taken{}", title(), is_wrong ? "; its toggle bit is wrong" : ""),
               is_wrong};
    } else {
      words = segment(bytes, "read");
    }
    next_toggle_ = !next_toggle_;
    if (!last_segment_came_) return words;
    SdoWords done = completed(mode);
    done.text = words.text + ": " + done.text;
    done.is_abnormal = words.is_abnormal;
    return done;
  }
  if (command == block_download_answer || command == block_upload_answer) return on_block_answer(bytes);
  return {fmt::format("unknown command 0x{:02X}", bytes[0]), true};
}

SdoWords SdoConversation::block_segment(ObjectBytes bytes) {
  const unsigned number = bytes[0] & 0x7F;
  last_segment_came_ = (bytes[0] & 0x80) != 0;
  const bool block_is_full = last_segment_came_ || number >= block_size_;
  if (block_is_full) phase_ = Phase::block_acknowledge;
  return {fmt::format("{} of {}: segment {} of the block{}", transfer_.is_write ? "write" : "read", title(),
                      number, last_segment_came_ ? ", the last" : "")};
}

SdoWords SdoConversation::on_block_request(ObjectBytes bytes) {
  const bool is_write = bytes[0] >> 5 == block_download_request;
  const unsigned step = bytes[0] & 3;
  const bool starts = is_write ? (step & 1) == 0 : step == 0;
  if (starts) {
    begin(is_write, bytes);
    is_block_ = true;
    block_size_ = is_write ? 0 : bytes[4];
    phase_ = Phase::block_started;
    return {doing() + " in blocks"};
  }
  if (!is_block_ || transfer_.is_write != is_write)
    return {"part of a block transfer that was not seen", true};
  constexpr unsigned acknowledges = 2;
  constexpr unsigned begins_segments = 3;
  if (!is_write && step == begins_segments) {
    phase_ = Phase::block_segments;
    return {fmt::format("read of {}: blocks may come", title())};
  }
  if (!is_write && step == acknowledges) {
    block_size_ = bytes[2];
    phase_ = last_segment_came_ ? Phase::block_end : Phase::block_segments;
    return {fmt::format("read of {}: {} segments taken", title(), bytes[1])};
  }
  if (is_write) {
    is_waiting_ = true;
    phase_ = Phase::block_end;
  } else {
    phase_ = Phase::idle;
  }
  return {fmt::format("{} of {}: end of the block transfer", is_write ? "write" : "read", title())};
}

SdoWords SdoConversation::on_block_answer(ObjectBytes bytes) {
  const bool is_write = bytes[0] >> 5 == block_download_answer;
  if (!is_block_ || transfer_.is_write != is_write)
    return {"part of a block transfer that was not seen", true};
  const unsigned step = bytes[0] & 3;
  if (!is_write) {
    const bool ends = (step & 1) != 0;
    if (ends) {
      phase_ = Phase::idle;
      return {fmt::format("read of {}: all blocks sent", title())};
    }
    return {fmt::format("{} comes in blocks, {}", title(),
                        (step & 2) != 0 ? fmt::format("{} bytes", unsigned32(bytes.subspan(4, 4)))
                                        : std::string("length not told"))};
  }
  constexpr unsigned starts = 0;
  constexpr unsigned acknowledges = 2;
  if (step == starts) {
    block_size_ = bytes[4];
    phase_ = Phase::block_segments;
    return {fmt::format("{} may be written in blocks of {} segments", title(), block_size_)};
  }
  if (step == acknowledges) {
    block_size_ = bytes[2];
    phase_ = last_segment_came_ ? Phase::block_end : Phase::block_segments;
    return {fmt::format("write of {}: {} segments taken", title(), bytes[1])};
  }
  phase_ = Phase::idle;
  return {fmt::format("{} written in blocks", title())};
}

}  // namespace alces::offline
