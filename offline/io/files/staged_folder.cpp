#include "staged_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "alces_platform/recording/file_sink.h"
#include "error.h"
#include "output_file.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

constexpr const char* inside_name = ".alces-part";

bool is_anything(const fs::path& path) {
  std::error_code ignored;
  return fs::symlink_status(path, ignored).type() != fs::file_type::not_found;
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::symlink_status(path, ignored).type() == fs::file_type::directory;
}

/// Of all entries, taken before any of them is moved.
std::vector<fs::path> names_in(const fs::path& folder) {
  std::vector<fs::path> names;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    names.push_back(entry.path().filename());
  return names;
}

/// Its own file system, or a part of one bound to this place: neither can be renamed.
bool is_mount_point(const fs::path& folder) {
  struct statx status {};
  if (::statx(AT_FDCWD, folder.c_str(), AT_SYMLINK_NOFOLLOW, STATX_BASIC_STATS, &status) != 0) return false;
  if ((status.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT) != 0)
    return (status.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0;
  struct stat own {};
  struct stat parent {};
  return ::lstat(folder.c_str(), &own) == 0 && ::lstat((folder / "..").c_str(), &parent) == 0 &&
         own.st_dev != parent.st_dev;
}

bool has_mount_point_inside(const fs::path& folder) {
  const std::vector<fs::path> names = names_in(folder);
  return std::any_of(names.begin(), names.end(), [&](const fs::path& name) {
    return is_folder(folder / name) && is_mount_point(folder / name);
  });
}

/// Whoever stands in a folder would be left standing in the old one.
bool is_working_folder(const fs::path& folder) {
  std::error_code ignored;
  for (fs::path at = fs::current_path(ignored); !at.empty(); at = at.parent_path()) {
    if (fs::equivalent(at, folder, ignored)) return true;
    if (at == at.root_path()) break;
  }
  return false;
}

bool may_write(const fs::path& folder) {
  return ::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) == 0;
}

/// scan007.frames, of 3DTK's poses.
bool is_frames_file(const std::string& name) {
  return name.starts_with("scan") && name.ends_with(".frames");
}

}  // namespace

bool StagedFolder::is_of_map(std::string_view name) {
  constexpr std::array<std::string_view, 10> names = {"trajectory.tum", "trajectory_without_loops.tum",
                                                      "scans.csv",      "counters.csv",
                                                      "graph.g2o",      "map.ply",
                                                      "run.json",       "covariances.csv",
                                                      "frames",         "scans.alces"};
  if (name.ends_with(".part")) name.remove_suffix(5);  // of an OutputFile that was killed
  return std::find(names.begin(), names.end(), name) != names.end();
}

StagedFolder::StagedFolder(const fs::path& folder, IsOurs is_ours)
    : shown_(folder), is_ours_(std::move(is_ours)) {
  std::error_code error;
  folder_ = fs::absolute(folder, error).lexically_normal();
  if (!folder_.has_filename()) folder_ = folder_.parent_path();
  if (fs::is_symlink(folder_, error)) {
    folder_ = fs::canonical(folder_, error);
    if (error) throw OutputError(shown_, "is a link that leads nowhere; remove it");
  }
  if (is_anything(folder_) && !is_folder(folder_))
    throw OutputError(shown_, "the folder cannot be made (a file is in the way)");
  const fs::path parent = folder_.parent_path();
  make_folder(parent);
  aside_ = parent / fmt::format(".{}.alces-old", folder_.filename().string());
  choose_staging();
  lock();
  recover();
  keep_devices();
}

void StagedFolder::choose_staging() {
  const fs::path parent = folder_.parent_path();
  const bool is_there = is_folder(folder_);
  if (is_there && !may_write(folder_)) fail("cannot be written", EACCES);
  is_inside_ = is_there && (is_mount_point(folder_) || is_working_folder(folder_) || !may_write(parent) ||
                            has_mount_point_inside(folder_));
  staging_ = is_inside_ ? folder_ / inside_name
                        : parent / fmt::format(".{}.alces-part", folder_.filename().string());
  synced_together_.emplace(staging_);
}

/// Held until this object or the process ends.
void StagedFolder::lock() {
  if (::mkdir(staging_.c_str(), 0777) != 0 && errno != EEXIST) fail("cannot be written", errno);
  lock_ = ::open(staging_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) fail("cannot be written", errno);
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    ::close(std::exchange(lock_, -1));
    throw OutputError(shown_, "is being written by another alces; wait for it, or write elsewhere");
  }
}

/// What a run left that was killed: the old folder aside, or files of others not yet back in theirs.
void StagedFolder::recover() {
  std::error_code ignored;
  if (is_folder(aside_)) {
    if (!is_anything(folder_)) fs::rename(aside_, folder_, ignored);
  }
  for (const fs::path& left : {staging_, aside_}) {
    for (const fs::path& name : names_in(left)) {
      if (is_ours_(name.string()) || !is_folder(folder_) || is_anything(folder_ / name)) continue;
      fs::rename(left / name, folder_ / name, ignored);
    }
  }
  if (is_folder(aside_) && is_folder(folder_)) fs::remove_all(aside_, ignored);
  for (const fs::path& name : names_in(staging_)) fs::remove_all(staging_ / name, ignored);
}

/// A link to /dev/null where map.ply would be stays one, and so the points are not kept.
void StagedFolder::keep_devices() const {
  std::error_code ignored;
  if (!is_folder(folder_)) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!is_ours_(name) || !entry.is_symlink(ignored) || !entry.exists(ignored)) continue;
    if (entry.is_regular_file(ignored) || entry.is_directory(ignored)) continue;
    fs::copy_symlink(entry.path(), staging_ / name, ignored);
  }
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  if (!is_committed_ && lock_ >= 0) fs::remove_all(staging_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

std::string StagedFolder::renamed(std::string sentence) const {
  const std::string hidden = staging_.string();
  for (std::size_t at = sentence.find(hidden); at != std::string::npos; at = sentence.find(hidden, at))
    sentence.replace(at, hidden.size(), shown_.string());
  return sentence;
}

void StagedFolder::fail(const std::string& what, int error_number) const {
  throw OutputError(shown_, fmt::format("{} ({}); write to a folder of yours on a disk that has room", what,
                                        std::generic_category().message(error_number)));
}

void StagedFolder::sync(const fs::path& folder) const {
  const int failed = sync_folder(folder.c_str());
  if (failed != 0) fail("cannot be written", failed);
}

void StagedFolder::commit() {
  // one call for a thousand files; what it cannot put on the disk must not replace what is there
  if (::syncfs(lock_) != 0) fail("cannot be written", errno);
  const fs::path parent = folder_.parent_path();
  if (!is_anything(folder_)) {
    if (::rename(staging_.c_str(), folder_.c_str()) != 0) fail("cannot be written", errno);
    is_committed_ = true;
    sync(parent);
    return;
  }
  if (is_inside_ || is_mount_point(folder_) || has_mount_point_inside(folder_)) {
    replace_file_by_file();
    return;
  }
  const std::vector<fs::path> later = carry_foreign();
  sync(staging_);
  if (!exchange()) {
    replace_file_by_file();
    return;
  }
  is_committed_ = true;
  std::error_code error;
  const fs::path old = is_anything(staging_) ? staging_ : aside_;
  for (const fs::path& name : later) {
    fs::rename(old / name, folder_ / name, error);
    if (error)
      throw OutputError(shown_, fmt::format("is written, but {} stayed in {} ({}); move it back",
                                            name.string(), old.string(), error.message()));
  }
  fs::remove_all(old, error);
  sync(parent);
}

/// Second names in the new folder for what is not ours. What can have none (folders) is to be renamed later.
std::vector<fs::path> StagedFolder::carry_foreign() {
  std::vector<fs::path> later;
  const auto carry = [&](const fs::path& name) {
    const fs::path from = folder_ / name;
    const fs::path to = staging_ / name;
    std::error_code error;
    if (is_anything(to)) return;
    if (fs::is_symlink(from, error)) {
      fs::copy_symlink(from, to, error);
      if (!error) return;
    } else if (!is_folder(from)) {
      fs::create_hard_link(from, to, error);
      if (!error) return;
    }
    later.push_back(name);
  };
  for (const fs::path& name : names_in(folder_))
    if (!is_ours_(name.string())) carry(name);
  if (is_folder(folder_ / "frames") && is_folder(staging_ / "frames")) {
    for (const fs::path& name : names_in(folder_ / "frames"))
      if (!is_frames_file(name.string())) carry("frames" / name);
  }
  struct stat status {};
  if (::stat(folder_.c_str(), &status) == 0) {
    static_cast<void>(::chmod(staging_.c_str(), status.st_mode & 07777));
    if (::chown(staging_.c_str(), status.st_uid, status.st_gid) != 0) return later;  // not ours to give
  }
  return later;
}

/// False: this folder has to stay where it is.
bool StagedFolder::exchange() {
  if (::renameat2(AT_FDCWD, staging_.c_str(), AT_FDCWD, folder_.c_str(), RENAME_EXCHANGE) == 0) return true;
  if (errno == EBUSY || errno == EXDEV || errno == EACCES || errno == EPERM) return false;
  if (errno != EINVAL && errno != ENOSYS && errno != EOPNOTSUPP) fail("cannot be written", errno);
  if (::rename(folder_.c_str(), aside_.c_str()) != 0) return false;
  if (::rename(staging_.c_str(), folder_.c_str()) == 0) return true;
  const int error_number = errno;
  static_cast<void>(::rename(aside_.c_str(), folder_.c_str()));
  fail("cannot be written", error_number);
}

/// run.json says that all files are of one map: it goes first and comes last.
void StagedFolder::replace_file_by_file() {
  std::error_code error;
  const auto put = [&](const fs::path& name) {
    fs::rename(staging_ / name, folder_ / name, error);
    if (error) throw OutputError(shown_ / name, "cannot be written (" + error.message() + ")");
  };
  std::vector<fs::path> files;
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(staging_, error)) {
    const fs::path name = entry.path().lexically_relative(staging_);
    (is_folder(entry.path()) ? folders : files).push_back(name);
  }
  std::sort(files.begin(), files.end());
  std::stable_partition(files.begin(), files.end(), [](const fs::path& name) { return name != "run.json"; });
  fs::remove(folder_ / "run.json", error);
  if (error) throw OutputError(shown_ / "run.json", "cannot be replaced (" + error.message() + ")");
  sync(folder_);
  for (const fs::path& name : folders) {
    fs::create_directory(folder_ / name, error);
    if (error) throw OutputError(shown_ / name, "the folder cannot be made (" + error.message() + ")");
  }
  std::vector<fs::path> gone;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const fs::path name = entry.path().filename();
    if (name != inside_name && is_ours_(name.string()) && !is_anything(staging_ / name)) gone.push_back(name);
  }
  if (is_folder(folder_ / "frames") && is_folder(staging_ / "frames")) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / "frames", error)) {
      const fs::path name = "frames" / entry.path().filename();
      if (is_frames_file(entry.path().filename().string()) && !is_anything(staging_ / name))
        gone.push_back(name);
    }
  }
  for (const fs::path& name : gone) fs::remove_all(folder_ / name, error);
  for (const fs::path& name : files) {
    if (name == "run.json") sync(folder_);
    put(name);
  }
  sync(folder_);
  fs::remove_all(staging_, error);
  is_committed_ = true;
}

}  // namespace alces::offline
