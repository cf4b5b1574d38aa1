// The relaxation between two iterations, as a file: written whole after each, so that whatever ends the
// program loses one iteration at most.
#pragma once

#include <filesystem>
#include <string>

#include "relaxation.h"

namespace alces::offline {

/// 56 bytes a pose, 8 a link. OutputError.
void write_checkpoint(const std::filesystem::path& file, const LumState& state,
                      const std::string& fingerprint);

/// Brings back the very same state. InputError when it is damaged, or of another map (`poses`) or other
/// settings
/// (`fingerprint`).
[[nodiscard]] LumState read_checkpoint(const std::filesystem::path& file, std::size_t poses,
                                       const std::string& fingerprint);

}  // namespace alces::offline
