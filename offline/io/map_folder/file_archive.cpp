#include "file_archive.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

std::string advice(ScanFileProblem problem) {
  switch (problem) {
    case ScanFileProblem::cannot_make:
      return "; name a file in a folder of yours";
    case ScanFileProblem::not_an_archive:
      return "; give --archive another name";
    case ScanFileProblem::cannot_write_begin:
    case ScanFileProblem::cannot_write:
      return "; free some space or name a file elsewhere";
    case ScanFileProblem::cannot_read:
    case ScanFileProblem::ends_early:
      return "; map again";
    default:
      return "";
  }
}

std::string sentence(const ScanFile& file) {
  const std::string why =
      file.error_number() != 0 ? " (" + std::generic_category().message(file.error_number()) + ")" : "";
  return to_string(file.problem()) + why + advice(file.problem());
}

}  // namespace

FileArchive::FileArchive(std::filesystem::path file, std::uint32_t scan_capacity) : path_(std::move(file)) {
  if (!file_.open(path_.c_str(), scan_capacity)) throw OutputError(path_, sentence(file_));
}

void FileArchive::put_in_words() {
  if (problem_.empty())
    problem_ = fmt::format("{}: scan {}: {}", path_.string(), file_.problem_scan(), sentence(file_));
}

bool FileArchive::write(std::uint32_t scan, std::span<const std::byte> bytes) {
  if (file_.write(scan, bytes)) return true;
  put_in_words();
  return false;
}

bool FileArchive::read(std::uint32_t scan, std::span<std::byte> bytes) {
  if (file_.read(scan, bytes)) return true;
  put_in_words();
  return false;
}

}  // namespace alces::offline
