// The server's side of SDO (CiA 301): expedited and segmented downloads and uploads of one node's object
// dictionary. Block transfers are refused, as small drives do. Only frames of 8 bytes are requests; others
// are counted.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "alces_platform/sim/motor/object_dictionary.h"

namespace alces::sim {

/// What an SDO server serves.
class SdoObjects {
 public:
  [[nodiscard]] virtual SdoAbort read_object(std::uint16_t index, std::uint8_t sub,
                                             std::vector<std::uint8_t>& bytes) = 0;
  [[nodiscard]] virtual SdoAbort write_object(std::uint16_t index, std::uint8_t sub,
                                              std::span<const std::uint8_t> bytes) = 0;

 protected:
  ~SdoObjects() = default;
};

class SdoServer {
 public:
  using Bytes = std::array<std::uint8_t, 8>;

  explicit SdoServer(SdoObjects& objects) : objects_(&objects) {}

  /// A running transfer is forgotten: at a reset.
  void reset() { transfer_ = Transfer::none; }

  /// The answer to a request, or nothing (the client's abort is not answered).
  [[nodiscard]] std::optional<Bytes> on_request(const Bytes& request);

  [[nodiscard]] std::uint64_t abort_count() const { return abort_count_; }

 private:
  enum class Transfer : std::uint8_t { none, download, upload };

  [[nodiscard]] Bytes abort(std::uint16_t index, std::uint8_t sub, SdoAbort code);
  [[nodiscard]] Bytes abort_transfer(SdoAbort code) { return abort(index_, sub_, code); }
  [[nodiscard]] Bytes start_download(const Bytes& request);
  [[nodiscard]] Bytes continue_download(const Bytes& request);
  [[nodiscard]] Bytes start_upload(const Bytes& request);
  [[nodiscard]] Bytes continue_upload(const Bytes& request);

  SdoObjects* objects_;
  Transfer transfer_ = Transfer::none;
  std::uint16_t index_ = 0;
  std::uint8_t sub_ = 0;
  bool toggle_ = false;
  std::optional<std::uint32_t> announced_bytes_;
  std::size_t sent_bytes_ = 0;
  std::vector<std::uint8_t> bytes_;
  std::uint64_t abort_count_ = 0;
};

}  // namespace alces::sim
