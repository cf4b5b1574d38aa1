// GPIO lines requested from the kernel through libgpiod: what differs between its versions, behind one
// declaration. Three sources define it, of which the build takes one: gpio_request_v1.cpp,
// gpio_request_v2.cpp, gpio_request_none.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "alces_drivers/encoder/edge.h"
#include "alces_platform/linux/message.h"

namespace alces {

enum class GpioEdges : std::uint8_t { both, rising, falling };
enum class GpioBias : std::uint8_t { as_is, disabled, pull_up, pull_down };

struct GpioLine {
  const char* line = "";  ///< its number on the chip, e.g. "17", or its name, e.g. "encoder-index"
  GpioEdges edges = GpioEdges::both;
  GpioBias bias = GpioBias::as_is;
  bool is_active_low = false;     ///< a rising edge is then one from high to low
  std::uint32_t debounce_us = 0;  ///< by the kernel, libgpiod 2 only; delays the stamp by as much
};

/// As the kernel hands it on.
struct StampedEdge {
  std::int64_t stamp_ns = 0;
  GpioEdge edge;
};

class GpioRequest {
 public:
  static constexpr std::size_t line_capacity = 8;
  /// What one read() can bring: the kernel's buffer is 16 edges a line (v1), 1024 a request (v2; read 64 at a
  /// time).
  static constexpr std::size_t read_capacity = 64;
  /// Edges in one read of v1 that mean that the buffer was full.
  static constexpr std::size_t buffer_v1 = 16;

  GpioRequest() = default;
  GpioRequest(const GpioRequest&) = delete;
  GpioRequest& operator=(const GpioRequest&) = delete;
  ~GpioRequest() { close(); }

  /// "libgpiod 1.6.3", "none".
  [[nodiscard]] static const char* version();
  /// Whether edges carry sequence numbers.
  [[nodiscard]] static bool has_sequence_numbers();

  /// Takes all of the lines as inputs with edge detection, or none: `error` says why. The library uses the
  /// heap here.
  [[nodiscard]] bool open(const char* chip_path, std::span<const GpioLine> lines, const char* consumer,
                          Message& error);
  void close();
  [[nodiscard]] bool is_open() const { return chip_ != nullptr; }

  /// Descriptors to poll: one a line (v1) or one for all (v2).
  [[nodiscard]] std::size_t descriptor_count() const;
  [[nodiscard]] int descriptor(std::size_t index) const;

  /// What waits on one descriptor, oldest first, without blocking; `edges` holds read_capacity.
  /// GpioEdge::line counts from 0 within this request. -1: errno says why.
  [[nodiscard]] int read(std::size_t index, std::span<StampedEdge> edges);

 private:
  // Opaque: v1 uses chip_ and lines_, v2 chip_, request_ and buffer_.
  void* chip_ = nullptr;
  [[maybe_unused]] void* request_ = nullptr;
  [[maybe_unused]] void* buffer_ = nullptr;
  [[maybe_unused]] std::array<void*, line_capacity> lines_{};
  [[maybe_unused]] std::array<unsigned, line_capacity> offsets_{};
  [[maybe_unused]] std::size_t line_count_ = 0;
};

}  // namespace alces
