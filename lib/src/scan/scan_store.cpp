#include "alces/scan_store.h"

#include <algorithm>
#include <cstring>

namespace alces {
namespace {

bool has_room(const ChannelCapacity& room, const ScanChannels& channels) {
  return (room.has_intensity || channels.intensity.empty()) && (room.has_time || channels.time_s.empty()) &&
         channels.signature.size() <= room.signature_bytes;
}

}  // namespace

Status ScanStore::add(std::span<const Point> points, float cell_size_m, const ScanChannels& channels) {
  if (scan_count_ == records_.size()) return Status::no_scan_capacity;
  if (points.size() > config_.point_capacity) return Status::no_point_capacity;
  if (points.empty()) return Status::empty_scan;
  if (!has_room(config_.channels, channels)) return Status::bad_channel;
  if (slots_.empty()) return Status::bad_config;
  const auto count = static_cast<std::uint32_t>(points.size());

  // The tree is built over the points as they will be decoded.
  const StoredScanBox box(points);
  const std::span<Point> rounded = point_scratch_.first(count);
  std::ranges::transform(points, rounded.begin(), [&box](const Point& p) { return box.round(p); });
  Slot& slot = oldest_slot();
  slot.scan = UINT32_MAX;
  if (!slot.tree.build(rounded, tree_scratch_)) return Status::no_point_capacity;
  slot.spacing = measure_spacing(slot.tree, config_.surface.neighbors);
  slot.sample_count = sample_surface(slot.tree, config_.surface, slot.spacing, slot.samples);

  const StoredScanContent content{.points = points,
                                  .order = &tree_scratch_,
                                  .cell_size_m = cell_size_m,
                                  .samples = slot.samples.first(slot.sample_count),
                                  .channels = channels};
  const std::size_t bytes = encode_stored_scan(box, content, record_scratch_);
  if (bytes == 0) return Status::bad_channel;
  const std::span<const std::byte> record = record_scratch_.first(bytes);

  Record entry{in_archive, count, static_cast<std::uint32_t>(bytes)};
  if (counters_.pool_bytes + record.size() <= pool_.size()) {
    entry.offset = counters_.pool_bytes;
    std::memcpy(pool_.data() + static_cast<std::size_t>(entry.offset), record.data(), record.size());
    counters_.pool_bytes += record.size();
  } else {
    if (archive_ == nullptr) return Status::no_point_capacity;
    if (!archive_->write(scan_count_, record)) return Status::archive_write_failed;
    counters_.archive_bytes += record.size();
    ++counters_.archived_scans;
  }
  records_[scan_count_] = entry;
  counters_.points += count;
  StoredScanView view;  // the tree is as it will be decoded already, the samples are not
  (void)StoredScanView::parse(record, view);
  take_samples(view, slot);
  slot.scan = scan_count_++;
  slot.last_use = ++use_;
  return Status::ok;
}

Status ScanStore::read_record(std::uint32_t scan, std::span<const std::byte>& record) {
  if (scan >= scan_count_) return Status::no_such_scan;
  const Record& entry = records_[scan];
  if (entry.offset != in_archive) {
    record = pool_.subspan(static_cast<std::size_t>(entry.offset), entry.bytes);
    return Status::ok;
  }
  const std::span<std::byte> buffer = record_scratch_.first(entry.bytes);
  if (archive_ == nullptr || !archive_->read(scan, buffer)) return Status::archive_read_failed;
  record = buffer;
  return Status::ok;
}

Status ScanStore::load(std::uint32_t scan, StoredScan& stored) {
  if (scan >= scan_count_) return Status::no_such_scan;
  Slot* slot = nullptr;
  for (Slot& candidate : slots_) {
    if (candidate.scan == scan) slot = &candidate;
  }
  if (slot != nullptr) {
    ++counters_.slot_hits;
  } else {
    ++counters_.slot_misses;
    slot = &oldest_slot();
    slot->scan = UINT32_MAX;
    std::span<const std::byte> record;
    if (const Status read = read_record(scan, record); read != Status::ok) return read;
    if (!decode(record, scan, *slot)) return Status::archive_read_failed;
  }
  slot->last_use = ++use_;
  stored = {&slot->tree, slot->samples.first(slot->sample_count), slot->spacing};
  return Status::ok;
}

ScanStore::Slot& ScanStore::oldest_slot() {
  return *std::min_element(slots_.begin(), slots_.end(),
                           [](const Slot& a, const Slot& b) { return a.last_use < b.last_use; });
}

void ScanStore::take_samples(const StoredScanView& view, Slot& slot) {
  slot.sample_count = view.sample_count();
  for (std::uint32_t i = 0; i < slot.sample_count; ++i) slot.samples[i] = view.sample(i);
}

bool ScanStore::decode(std::span<const std::byte> record, std::uint32_t scan, Slot& slot) {
  StoredScanView view;  // an archive may hand back anything
  if (StoredScanView::parse(record, view) != StoredScanFault::none) return false;
  if (view.point_count() != records_[scan].point_count || view.sample_count() > slot.samples.size())
    return false;
  const std::span<Point> points = point_scratch_.first(view.point_count());
  for (std::uint32_t i = 0; i < view.point_count(); ++i) points[i] = view.point(i);
  take_samples(view, slot);
  if (!slot.tree.restore(points)) return false;
  slot.spacing = measure_spacing(slot.tree, config_.surface.neighbors);  // the same tree gives the same
  slot.scan = scan;
  slot.last_use = ++use_;
  return true;
}

}  // namespace alces
