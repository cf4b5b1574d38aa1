#include "alces/scan_signature.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

constexpr std::uint32_t sectors_of_octant = ScanSignature::sectors / 8;
// Tangents of the sectors' borders within an octant: 5.625 deg apart.
constexpr std::array<float, sectors_of_octant - 1> border_slopes = {
    0.09849140F, 0.19891237F, 0.30334668F, 0.41421356F, 0.53451114F, 0.66817864F, 0.82067879F};
constexpr float sector_rad = 6.28318531F / static_cast<float>(ScanSignature::sectors);

// By comparisons alone, where an arc tangent would take ten times as long.
std::uint32_t sector_of(float x, float y) {
  const float across = std::abs(x);
  const float along = std::abs(y);
  const float larger = std::max(across, along);
  const float smaller = std::min(across, along);
  std::uint32_t sector = 0;
  for (const float slope : border_slopes) sector += smaller >= slope * larger ? 1 : 0;
  if (along > across) sector = 2 * sectors_of_octant - 1 - sector;
  if (x < 0) sector = 4 * sectors_of_octant - 1 - sector;
  return y < 0 ? 8 * sectors_of_octant - 1 - sector : sector;
}

std::uint32_t sum_of_differences(const std::uint8_t* a, const std::uint8_t* b, std::size_t count) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += static_cast<std::uint32_t>(std::abs(a[i] - b[i]));
  return sum;
}

// What both have, as a share of what either has: sums of the smaller and of the larger of each two cells.
float share(std::uint32_t sum, std::uint32_t difference) {
  return static_cast<float>(sum - difference) / static_cast<float>(sum + difference);
}

}  // namespace

ScanSignature ScanSignature::of(std::span<const Point> points, float x_m, float y_m) {
  constexpr float farthest_m = ring_width_m * static_cast<float>(rings);
  ScanSignature signature;
  for (const Point& point : points) {
    const float x = point.x - x_m;
    const float y = point.y - y_m;
    const float range_m2 = x * x + y * y;
    const float height = (point.z - lowest_m) / height_step_m;
    if (!(range_m2 < farthest_m * farthest_m) || !(height >= 1)) continue;
    const auto ring =
        std::min(static_cast<std::uint32_t>(std::sqrt(range_m2) * (1 / ring_width_m)), rings - 1);
    std::uint8_t& cell = signature.cells_[sector_of(x, y) * rings + ring];
    cell = std::max(cell, static_cast<std::uint8_t>(std::min(height, float{highest})));
  }
  signature.add_up();
  return signature;
}

void ScanSignature::add_up() {
  ring_sums_.fill(0);
  sum_ = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    ring_sums_[i % rings] = static_cast<std::uint16_t>(ring_sums_[i % rings] + cells_[i]);
    sum_ += cells_[i];
  }
}

bool ScanSignature::read(std::span<const std::byte> bytes, std::uint16_t stored_version) {
  *this = ScanSignature{};
  if (stored_version != version || bytes.size() != stored_bytes) return false;
  for (std::size_t i = 0; i < stored_bytes; ++i) {
    const auto both = std::to_integer<std::uint8_t>(bytes[i]);
    cells_[2 * i] = both & 15;
    cells_[2 * i + 1] = static_cast<std::uint8_t>(both >> 4);
  }
  add_up();
  return true;
}

void ScanSignature::write(std::span<std::byte, stored_bytes> bytes) const {
  for (std::size_t i = 0; i < stored_bytes; ++i)
    bytes[i] = static_cast<std::byte>(cells_[2 * i] | cells_[2 * i + 1] << 4);
}

// Entry s: the data turned by s sectors.
void ScanSignature::correlate_all(const ScanSignature& data, Likenesses& likenesses) const {
  for (std::size_t turn = 0; turn < sectors; ++turn) {
    const std::size_t turned = turn * rings;
    const std::size_t rest = cells_.size() - turned;
    const std::uint32_t difference = sum_of_differences(cells_.data() + turned, data.cells_.data(), rest) +
                                     sum_of_differences(cells_.data(), data.cells_.data() + rest, turned);
    likenesses[turn] = share(sum_ + data.sum_, difference);
  }
}

std::uint32_t ScanSignature::correlate(const ScanSignature& data, std::span<YawCandidate> candidates) const {
  if (sum_ == 0 || data.sum_ == 0) return 0;
  Likenesses likenesses;
  correlate_all(data, likenesses);
  std::uint32_t found = 0;
  for (std::uint32_t turn = 0; turn < sectors; ++turn) {
    const float here = likenesses[turn];
    // Of equal neighbours the first one is the peak.
    if (here <= likenesses[(turn + sectors - 1) % sectors] || here < likenesses[(turn + 1) % sectors])
      continue;
    std::size_t place = std::min<std::size_t>(found, candidates.size());
    while (place > 0 && candidates[place - 1].likeness < here) --place;
    if (place == candidates.size()) continue;
    found = std::min(found + 1, static_cast<std::uint32_t>(candidates.size()));
    for (std::size_t i = found - 1; i > place; --i) candidates[i] = candidates[i - 1];
    const auto signed_turn = static_cast<std::int32_t>(turn < sectors / 2 ? turn : turn - sectors);
    candidates[place] = {static_cast<float>(signed_turn) * sector_rad, here};
  }
  if (found == 0 && !candidates.empty()) {  // alike all around
    candidates[0] = {0, likenesses[0]};
    found = 1;
  }
  return found;
}

float ScanSignature::likeness(const ScanSignature& data) const {
  if (sum_ == 0 || data.sum_ == 0) return 0;
  Likenesses likenesses;
  correlate_all(data, likenesses);
  return *std::ranges::max_element(likenesses);
}

float ScanSignature::likeness_bound(const ScanSignature& data) const {
  if (sum_ == 0 || data.sum_ == 0) return 0;
  std::uint32_t difference = 0;
  for (std::size_t ring = 0; ring < rings; ++ring)
    difference += static_cast<std::uint32_t>(std::abs(ring_sums_[ring] - data.ring_sums_[ring]));
  return share(sum_ + data.sum_, difference);
}

}  // namespace alces
