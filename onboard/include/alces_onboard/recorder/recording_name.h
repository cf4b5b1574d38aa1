// The file that a drive is recorded to.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace alces::onboard {

/// `name` with every %t replaced by the UTC time, "20261122T065353Z", and every %% by %.
[[nodiscard]] std::string expand_recording_name(const std::string& name, std::int64_t utc_ns);

/// `file`, or, because a drive is never overwritten (a service that is restarted has the same configuration),
/// the first of file-2.mcap, file-3.mcap, ... that is not there.
[[nodiscard]] std::filesystem::path unused_name(const std::filesystem::path& file);

}  // namespace alces::onboard
