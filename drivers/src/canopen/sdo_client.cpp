#include "alces_drivers/canopen/sdo_client.h"

#include <algorithm>

#include "alces_drivers/canopen/bytes.h"
#include "alces_drivers/canopen/cob_id.h"
#include "alces_drivers/canopen/sdo_abort.h"

namespace alces::canopen {

const char* to_string(SdoStatus status) {
  switch (status) {
    case SdoStatus::idle:
      return "idle";
    case SdoStatus::busy:
      return "busy";
    case SdoStatus::done:
      return "done";
    case SdoStatus::aborted:
      return "aborted by the node";
    case SdoStatus::timed_out:
      return "no answer";
    case SdoStatus::not_sent:
      return "the bus did not take the request";
    case SdoStatus::too_large:
      return "the object is larger than the buffer";
    case SdoStatus::size_mismatch:
      return "not as many bytes as announced";
    case SdoStatus::bad_toggle:
      return "a segment came twice or was lost: its toggle bit did not alternate";
  }
  return "unknown";
}

SdoClient::SdoClient(std::uint8_t node, const SdoTiming& timing, CanPort& port)
    : node_(node), timing_(timing), port_(port) {}

bool SdoClient::download(ObjectAddress object, std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  if (is_busy() || bytes.empty() || bytes.size() > maximum_bytes) return false;
  std::ranges::copy(bytes, buffer_.begin());
  size_ = static_cast<std::uint32_t>(bytes.size());
  is_download_ = true;
  begin(Phase::initiate_download, object, now_ns);
  return true;
}

bool SdoClient::download(const ObjectWrite& write, std::int64_t now_ns) {
  if (write.size > 4) return false;
  std::array<std::uint8_t, 4> bytes{};
  store(write.value, bytes, write.size);
  return download(write.address(), std::span(bytes).first(write.size), now_ns);
}

bool SdoClient::upload(ObjectAddress object, std::int64_t now_ns) {
  if (is_busy()) return false;
  is_download_ = false;
  begin(Phase::initiate_upload, object, now_ns);
  return true;
}

void SdoClient::cancel() {
  if (!is_busy()) return;
  if (is_sent_ && !port_.send(sdo_abort_request(node_, object_, sdo_abort_general)))
    ++counters_.requests_not_taken;
  status_ = SdoStatus::idle;
}

std::uint32_t SdoClient::value() const {
  return load(bytes(), 4);
}

void SdoClient::begin(Phase phase, ObjectAddress object, std::int64_t now_ns) {
  ++counters_.transfers;
  phase_ = phase;
  object_ = object;
  status_ = SdoStatus::busy;
  abort_code_ = 0;
  retries_left_ = timing_.retry_limit;
  initiate(now_ns);
}

void SdoClient::initiate(std::int64_t now_ns) {
  toggle_ = false;
  if (is_download_) {
    phase_ = Phase::initiate_download;
    offset_ = 0;
    in_flight_ = 0;
    ask(sdo_download_request(node_, object_, bytes()), now_ns);
  } else {
    phase_ = Phase::initiate_upload;
    size_ = 0;
    has_total_ = false;
    ask(sdo_upload_request(node_, object_), now_ns);
  }
}

void SdoClient::ask(const CanFrame& request, std::int64_t now_ns) {
  request_ = request;
  deadline_ns_ = now_ns + timing_.response_timeout_ns;
  is_sent_ = port_.send(request_);
  if (!is_sent_) ++counters_.requests_not_taken;
}

void SdoClient::ask_next_segment(std::int64_t now_ns) {
  if (is_download_) {
    in_flight_ = std::min<std::uint32_t>(size_ - offset_, 7);
    ask(sdo_download_segment(node_, bytes().subspan(offset_, in_flight_), toggle_,
                             offset_ + in_flight_ == size_),
        now_ns);
  } else {
    ask(sdo_upload_segment_request(node_, toggle_), now_ns);
  }
}

void SdoClient::give_up(SdoStatus status, std::uint32_t abort_code) {
  if (!port_.send(sdo_abort_request(node_, object_, abort_code))) ++counters_.requests_not_taken;
  abort_code_ = abort_code;
  finish(status);
}

void SdoClient::on_tick(std::int64_t now_ns) {
  if (!is_busy()) return;
  if (now_ns >= deadline_ns_) {
    if (is_sent_) {
      ++counters_.timeouts;
      give_up(SdoStatus::timed_out, sdo_abort_timed_out);
    } else {
      finish(SdoStatus::not_sent);
    }
    if (retries_left_ == 0) return;
    --retries_left_;
    ++counters_.retries;
    abort_code_ = 0;
    status_ = SdoStatus::busy;
    initiate(now_ns);
  } else if (!is_sent_) {
    is_sent_ = port_.send(request_);
    if (is_sent_) {
      deadline_ns_ = now_ns + timing_.response_timeout_ns;
    } else {
      ++counters_.requests_not_taken;
    }
  }
}

bool SdoClient::on_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  if (frame.id != sdo_response_cob_id(node_) || !frame.is_classical_data()) return false;
  const std::optional<SdoMessage> answer = decode_sdo(frame);
  if (!answer) {
    ++counters_.answers_malformed;
  } else if (!is_busy() || !is_sent_) {
    ++counters_.answers_late;
  } else {
    on_response(*answer, stamp_ns);
  }
  return true;
}

void SdoClient::on_response(const SdoMessage& answer, std::int64_t stamp_ns) {
  const bool is_initiate = phase_ == Phase::initiate_download || phase_ == Phase::initiate_upload;
  const bool names_object = answer.kind == SdoKind::abort || answer.kind == SdoKind::download_response ||
                            answer.kind == SdoKind::upload_response;
  // Servers may leave the object out when they abort a segment.
  const bool is_nameless_abort =
      answer.kind == SdoKind::abort && !is_initiate && answer.object == ObjectAddress{};
  if (names_object && answer.object != object_ && !is_nameless_abort) {
    ++counters_.answers_foreign;
    return;
  }
  if (answer.kind == SdoKind::abort) {
    ++counters_.aborts_received;
    abort_code_ = answer.abort_code;
    finish(SdoStatus::aborted);
    return;
  }
  switch (phase_) {
    case Phase::initiate_download:
      if (answer.kind != SdoKind::download_response) break;
      if (size_ <= 4) {
        finish(SdoStatus::done);
      } else {
        phase_ = Phase::download_segment;
        ask_next_segment(stamp_ns);
      }
      return;
    case Phase::download_segment:
      if (answer.kind != SdoKind::download_segment_response) break;
      if (answer.toggle != toggle_) {
        ++counters_.answers_repeated;
        give_up(SdoStatus::bad_toggle, sdo_abort_toggle);
        return;
      }
      offset_ += in_flight_;
      toggle_ = !toggle_;
      if (offset_ == size_) {
        finish(SdoStatus::done);
      } else {
        ask_next_segment(stamp_ns);
      }
      return;
    case Phase::initiate_upload:
      if (answer.kind != SdoKind::upload_response) break;
      on_upload_response(answer, stamp_ns);
      return;
    case Phase::upload_segment:
      if (answer.kind != SdoKind::upload_segment_response) break;
      on_upload_segment(answer, stamp_ns);
      return;
  }
  ++counters_.answers_unexpected;
}

void SdoClient::on_upload_response(const SdoMessage& answer, std::int64_t stamp_ns) {
  if (answer.is_expedited) {
    (void)append(answer.bytes());
    finish(SdoStatus::done);
    return;
  }
  has_total_ = answer.has_total;
  total_bytes_ = answer.total_bytes;
  if (has_total_ && total_bytes_ > maximum_bytes) {
    give_up(SdoStatus::too_large, sdo_abort_out_of_memory);
    return;
  }
  phase_ = Phase::upload_segment;
  ask_next_segment(stamp_ns);
}

void SdoClient::on_upload_segment(const SdoMessage& answer, std::int64_t stamp_ns) {
  if (answer.toggle != toggle_) {
    ++counters_.answers_repeated;
    const auto again = answer.bytes();
    const bool is_repetition =
        !again.empty() && again.size() <= size_ && std::ranges::equal(again, bytes().last(again.size()));
    if (!is_repetition) give_up(SdoStatus::bad_toggle, sdo_abort_toggle);  // else the bus's: dropped
    return;
  }
  if (!append(answer.bytes())) {
    give_up(SdoStatus::too_large, sdo_abort_out_of_memory);
  } else if (has_total_ && (size_ > total_bytes_ || (answer.is_last && size_ != total_bytes_))) {
    give_up(SdoStatus::size_mismatch, sdo_abort_size_mismatch);
  } else if (answer.is_last) {
    finish(SdoStatus::done);
  } else {
    toggle_ = !toggle_;
    ask_next_segment(stamp_ns);
  }
}

bool SdoClient::append(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > maximum_bytes - size_) return false;
  std::ranges::copy(bytes, buffer_.begin() + size_);
  size_ += static_cast<std::uint32_t>(bytes.size());
  return true;
}

}  // namespace alces::canopen
