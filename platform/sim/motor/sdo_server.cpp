#include "alces_platform/sim/motor/sdo_server.h"

#include <algorithm>

namespace alces::sim {
namespace {

// Command specifiers, the upper three bits of the first byte.
constexpr unsigned client_download_segment = 0;
constexpr unsigned client_start_download = 1;
constexpr unsigned client_start_upload = 2;
constexpr unsigned client_upload_segment = 3;
constexpr unsigned client_abort = 4;

constexpr std::size_t longest_download_bytes = 1024;  // no object here is longer

std::uint16_t index_of(const SdoServer::Bytes& frame) {
  return static_cast<std::uint16_t>(frame[1] | frame[2] << 8);
}

SdoServer::Bytes answer(unsigned command, std::uint16_t index, std::uint8_t sub) {
  return {static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(index & 0xFF),
          static_cast<std::uint8_t>(index >> 8), sub};
}

void put_unsigned32(SdoServer::Bytes& frame, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) frame[4 + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

}  // namespace

std::optional<SdoServer::Bytes> SdoServer::on_request(const Bytes& request) {
  switch (request[0] >> 5) {
    case client_download_segment:
      return continue_download(request);
    case client_start_download:
      return start_download(request);
    case client_start_upload:
      return start_upload(request);
    case client_upload_segment:
      return continue_upload(request);
    case client_abort:
      reset();
      return std::nullopt;
    default:
      return abort(index_of(request), request[3], SdoAbort::command);
  }
}

SdoServer::Bytes SdoServer::abort(std::uint16_t index, std::uint8_t sub, SdoAbort code) {
  reset();
  ++abort_count_;
  Bytes frame = answer(0x80, index, sub);
  put_unsigned32(frame, static_cast<std::uint32_t>(code));
  return frame;
}

SdoServer::Bytes SdoServer::start_download(const Bytes& request) {
  const bool is_expedited = (request[0] & 0x02) != 0;
  const bool has_size = (request[0] & 0x01) != 0;
  index_ = index_of(request);
  sub_ = request[3];
  if (is_expedited) {
    std::size_t size = has_size ? 4U - ((request[0] >> 2) & 3U) : 4U;
    SdoAbort code = objects_->write_object(index_, sub_, std::span(request).subspan(4, size));
    while (!has_size && code == SdoAbort::length &&
           size > 1) {  // a size that is not told is the object's own
      size /= 2;
      code = objects_->write_object(index_, sub_, std::span(request).subspan(4, size));
    }
    if (code != SdoAbort::none) return abort_transfer(code);
    reset();
    return answer(0x60, index_, sub_);
  }
  announced_bytes_.reset();
  if (has_size) {
    announced_bytes_ =
        static_cast<std::uint32_t>(decode_little_endian(std::span(request).subspan(4), DataType::unsigned32));
  }
  if (announced_bytes_ > longest_download_bytes) return abort_transfer(SdoAbort::length);
  transfer_ = Transfer::download;
  toggle_ = false;
  bytes_.clear();
  return answer(0x60, index_, sub_);
}

SdoServer::Bytes SdoServer::continue_download(const Bytes& request) {
  if (transfer_ != Transfer::download) return abort_transfer(SdoAbort::command);
  if (((request[0] & 0x10) != 0) != toggle_) return abort_transfer(SdoAbort::toggle_bit);
  const std::size_t size = 7U - ((request[0] >> 1) & 7U);
  bytes_.insert(bytes_.end(), request.begin() + 1, request.begin() + 1 + static_cast<std::ptrdiff_t>(size));
  if (bytes_.size() > longest_download_bytes) return abort_transfer(SdoAbort::length);
  Bytes frame{};
  frame[0] = static_cast<std::uint8_t>(0x20 | (toggle_ ? 0x10 : 0));
  toggle_ = !toggle_;
  const bool is_last = (request[0] & 0x01) != 0;
  if (!is_last) return frame;
  if (announced_bytes_ && *announced_bytes_ != bytes_.size()) return abort_transfer(SdoAbort::length);
  const SdoAbort code = objects_->write_object(index_, sub_, bytes_);
  if (code != SdoAbort::none) return abort_transfer(code);
  reset();
  return frame;
}

SdoServer::Bytes SdoServer::start_upload(const Bytes& request) {
  index_ = index_of(request);
  sub_ = request[3];
  const SdoAbort code = objects_->read_object(index_, sub_, bytes_);
  if (code != SdoAbort::none) return abort_transfer(code);
  if (!bytes_.empty() && bytes_.size() <= 4) {
    reset();
    const auto unused = static_cast<unsigned>(4 - bytes_.size());
    Bytes frame = answer(0x43U | unused << 2, index_, sub_);
    std::ranges::copy(bytes_, frame.begin() + 4);
    return frame;
  }
  transfer_ = Transfer::upload;
  toggle_ = false;
  sent_bytes_ = 0;
  Bytes frame = answer(0x41, index_, sub_);
  put_unsigned32(frame, static_cast<std::uint32_t>(bytes_.size()));
  return frame;
}

SdoServer::Bytes SdoServer::continue_upload(const Bytes& request) {
  if (transfer_ != Transfer::upload) return abort_transfer(SdoAbort::command);
  if (((request[0] & 0x10) != 0) != toggle_) return abort_transfer(SdoAbort::toggle_bit);
  const std::size_t size = std::min<std::size_t>(7, bytes_.size() - sent_bytes_);
  Bytes frame{};
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(sent_bytes_), size, frame.begin() + 1);
  sent_bytes_ += size;
  const bool is_last = sent_bytes_ == bytes_.size();
  frame[0] = static_cast<std::uint8_t>((toggle_ ? 0x10U : 0U) | (7U - size) << 1 | (is_last ? 1U : 0U));
  toggle_ = !toggle_;
  if (is_last) reset();
  return frame;
}

}  // namespace alces::sim
