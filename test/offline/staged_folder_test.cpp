// A folder that is replaced whole: what stays, what goes, and what is found wherever it is interrupted.
#include "offline/io/files/staged_folder.h"

#include <fcntl.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "offline/io/files/error.h"
#include "temporary_folder.h"

using namespace alces::offline;
using Catch::Contains;

namespace fs = std::filesystem;

namespace {

/// A file system that knows no exchange, as FAT and NFS.
bool has_exchange = true;
/// So many renames go well, then one fails; negative: none fails.
int renames_until_failure = -1;

}  // namespace

// In place of the C library's, for this program alone.
extern "C" int renameat2(int from_folder, const char* from, int to_folder, const char* to,
                         unsigned flags) noexcept {
  if (flags != 0 && !has_exchange) {
    errno = EINVAL;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
}

extern "C" int rename(const char* from, const char* to) noexcept {
  if (renames_until_failure == 0) {
    renames_until_failure = -1;
    errno = EIO;
    return -1;
  }
  if (renames_until_failure > 0) --renames_until_failure;
  return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}

namespace {

struct WithoutExchange {
  WithoutExchange() { has_exchange = false; }
  WithoutExchange(const WithoutExchange&) = delete;
  WithoutExchange& operator=(const WithoutExchange&) = delete;
  ~WithoutExchange() {
    has_exchange = true;
    renames_until_failure = -1;
  }
};

void put(const fs::path& file, std::string_view text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

void write_map(const fs::path& folder, const std::string& text, bool has_counters = false) {
  for (const char* name : {"trajectory.tum", "map.ply", "run.json"}) put(folder / name, text);
  put(folder / "frames" / "scan000.frames", text);
  if (has_counters) put(folder / "counters.csv", text);
}

void replace(const fs::path& folder, const std::string& text) {
  StagedFolder stage(folder);
  write_map(stage.staging(), text);
  stage.commit();
}

/// Of one map, and that is `text`.
void check_map(const fs::path& folder, const std::string& text) {
  for (const char* name : {"trajectory.tum", "map.ply", "run.json", "frames/scan000.frames"}) {
    CAPTURE(name);
    CHECK(content_of(folder / name) == text);
  }
}

/// No name but these.
void check_names(const fs::path& folder, const std::set<std::string>& names) {
  std::set<std::string> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    found.insert(entry.path().filename());
  CHECK(found == names);
}

}  // namespace

TEST_CASE("a staged folder is not there before it is whole, and then it is all there") {
  const TemporaryFolder folder;
  {
    StagedFolder stage(folder / "town");
    write_map(stage.staging(), "new");
    CHECK_FALSE(fs::exists(folder / "town"));
    stage.commit();
    check_map(folder / "town", "new");
  }
  check_names(folder.path(), {"town"});
}

TEST_CASE("without commit nothing has happened") {
  const TemporaryFolder folder;
  write_map(folder / "town", "old", true);
  {
    StagedFolder stage(folder / "town");
    write_map(stage.staging(), "new");
  }
  check_map(folder / "town", "old");
  CHECK(fs::exists(folder / "town/counters.csv"));
  check_names(folder.path(), {"town"});
}

TEST_CASE("files of an earlier map go, files of others stay") {
  const TemporaryFolder folder;
  write_map(folder / "town", "old", true);
  put(folder / "town/frames/scan001.frames", "old");
  put(folder / "town/notes.txt", "mine");
  put(folder / "town/frames/readme", "mine");
  put(folder / "town/photos/a.jpg", "mine");
  fs::create_symlink("notes.txt", folder / "town/link");
  fs::permissions(folder / "town", fs::perms::owner_all | fs::perms::group_read);
  replace(folder / "town", "new");
  check_map(folder / "town", "new");
  check_names(folder / "town",
              {"trajectory.tum", "map.ply", "run.json", "frames", "notes.txt", "photos", "link"});
  CHECK(content_of(folder / "town/photos/a.jpg") == "mine");
  CHECK(content_of(folder / "town/link") == "mine");
  CHECK(content_of(folder / "town/frames/readme") == "mine");
  CHECK_FALSE(fs::exists(folder / "town/frames/scan001.frames"));
  CHECK(fs::status(folder / "town").permissions() == (fs::perms::owner_all | fs::perms::group_read));
  check_names(folder.path(), {"town"});
}

TEST_CASE("a file in the folder that is open meanwhile, as an archive, is the same file afterwards") {
  const TemporaryFolder folder;
  write_map(folder / "town", "old");
  std::ofstream archive(folder / "town/scans.archive");
  archive << "before ";
  archive.flush();
  replace(folder / "town", "new");
  archive << "after";
  archive.close();
  CHECK(content_of(folder / "town/scans.archive") == "before after");
}

TEST_CASE("a link to a folder stays a link, and the folder behind it is replaced") {
  const TemporaryFolder folder;
  write_map(folder / "real", "old");
  fs::create_directory_symlink("real", folder / "town");
  replace(folder / "town", "new");
  CHECK(fs::is_symlink(folder / "town"));
  check_map(folder / "real", "new");
  fs::create_directory_symlink("nowhere", folder / "lost");
  CHECK_THROWS_WITH(replace(folder / "lost", "new"), Contains("leads nowhere"));
}

TEST_CASE(
    "the working folder and a mount point are replaced file by file, without a mix that claims to be a map") {
  const TemporaryFolder folder;
  const fs::path town = folder / "town";
  write_map(town, "old", true);
  put(town / "notes.txt", "mine");
  bool is_mounted = false;
  SECTION("the working folder") {
    const fs::path before = fs::current_path();
    fs::current_path(town);
    replace(town, "new");
    CHECK(fs::exists("map.ply"));  // of the folder we stand in
    fs::current_path(before);
  }
  SECTION("a mount point") {
    is_mounted = ::mount(town.c_str(), town.c_str(), nullptr, MS_BIND, nullptr) == 0;
    if (!is_mounted) WARN("skipped, no test data: may not mount");
    replace(town, "new");
  }
  SECTION("a mount point in it") {
    fs::create_directory(town / "data");
    put(town / "data/a", "mine");
    is_mounted = ::mount((town / "data").c_str(), (town / "data").c_str(), nullptr, MS_BIND, nullptr) == 0;
    replace(town, "new");
    CHECK(content_of(town / "data/a") == "mine");
    if (is_mounted) ::umount((town / "data").c_str());
    is_mounted = false;
    fs::remove_all(town / "data");
  }
  check_map(town, "new");
  check_names(town, {"trajectory.tum", "map.ply", "run.json", "frames", "notes.txt"});
  if (is_mounted) ::umount(town.c_str());
  check_names(folder.path(), {"town"});
}

TEST_CASE("two processes do not write one folder at a time") {
  const TemporaryFolder folder;
  const StagedFolder first(folder / "town");
  CHECK_THROWS_WITH(StagedFolder(folder / "town"), Contains("another alces"));
}

TEST_CASE("what a killed run left is put right by the next one") {
  const TemporaryFolder folder;
  SECTION("killed while it wrote") {
    write_map(folder / "town", "old");
    write_map(folder / ".town.alces-part", "part");
  }
  SECTION("killed between exchange and tidying up") {
    write_map(folder / "town", "new");
    write_map(folder / ".town.alces-part", "old");
    put(folder / ".town.alces-part/photos/a.jpg", "mine");
  }
  SECTION("killed between two renames, on a file system without exchange") {
    write_map(folder / ".town.alces-old", "old");
    put(folder / ".town.alces-old/photos/a.jpg", "mine");
    write_map(folder / ".town.alces-part", "new");
  }
  const bool has_photos =
      fs::exists(folder / ".town.alces-part/photos") || fs::exists(folder / ".town.alces-old/photos");
  { const StagedFolder stage(folder / "town"); }
  CHECK(fs::exists(folder / "town/run.json"));
  check_map(folder / "town", content_of(folder / "town/run.json"));
  CHECK(fs::exists(folder / "town/photos/a.jpg") == has_photos);
  check_names(folder.path(), {"town"});
}

TEST_CASE("on a file system without exchange a folder is replaced by two renames, files of others stay") {
  const WithoutExchange fat;
  const TemporaryFolder folder;
  const fs::path town = folder / "town";
  write_map(town, "old", true);
  put(town / "notes.txt", "mine");
  put(town / "photos/a.jpg", "mine, too");
  put(town / "open.archive", "in use");
  const int open = ::open((town / "open.archive").c_str(), O_RDONLY);
  REQUIRE(open >= 0);
  replace(town, "new");
  check_map(town, "new");
  CHECK_FALSE(fs::exists(town / "counters.csv"));
  CHECK(content_of(town / "notes.txt") == "mine");
  CHECK(content_of(town / "photos/a.jpg") == "mine, too");
  struct stat held {};
  struct stat there {};
  CHECK(::fstat(open, &held) == 0);
  CHECK(::stat((town / "open.archive").c_str(), &there) == 0);
  CHECK(held.st_ino == there.st_ino);
  ::close(open);
  check_names(folder.path(), {"town"});
}

TEST_CASE("without exchange, a rename that fails leaves the old folder under its name") {
  const WithoutExchange fat;
  const TemporaryFolder folder;
  write_map(folder / "town", "old");
  {
    StagedFolder stage(folder / "town");
    write_map(stage.staging(), "new");
    renames_until_failure = 1;  // the old one aside goes well
    CHECK_THROWS_WITH(stage.commit(), Contains("cannot be written (Input/output error)"));
  }
  check_map(folder / "town", "old");
  check_names(folder.path(), {"town"});
}

TEST_CASE("without exchange, killed at any time, the next run finds one whole map") {
  const WithoutExchange fat;
  const TemporaryFolder folder;
  const fs::path town = folder / "town";
  write_map(town, "0");
  put(town / "notes.txt", "mine");
  for (int round = 0; round < 40; ++round) {
    const pid_t writer = ::fork();
    REQUIRE(writer >= 0);
    if (writer == 0) {
      for (int i = 1;; ++i) replace(town, std::to_string(i % 7 + 1));
    }
    ::usleep(static_cast<useconds_t>(1000 + 700 * round));
    ::kill(writer, SIGKILL);
    int status = 0;
    ::waitpid(writer, &status, 0);
    { const StagedFolder next(town); }
    REQUIRE(fs::exists(town / "run.json"));
    check_map(town, content_of(town / "run.json"));
    CHECK(content_of(town / "notes.txt") == "mine");
  }
  replace(town, "last");
  check_map(town, "last");
  check_names(folder.path(), {"town"});
}

TEST_CASE("killed at any time, a folder is of one map, and files of others are in it") {
  const TemporaryFolder folder;
  const fs::path town = folder / "town";
  write_map(town, "0");
  put(town / "notes.txt", "mine");
  for (int round = 0; round < 40; ++round) {
    const pid_t writer = ::fork();
    REQUIRE(writer >= 0);
    if (writer == 0) {
      for (int i = 1;; ++i) replace(town, std::to_string(i % 7 + 1));
    }
    ::usleep(static_cast<useconds_t>(1000 + 700 * round));
    ::kill(writer, SIGKILL);
    int status = 0;
    ::waitpid(writer, &status, 0);
    const bool is_there = fs::exists(town / "run.json");
    CHECK(is_there);
    if (!is_there) break;
    check_map(town, content_of(town / "run.json"));
    CHECK(content_of(town / "notes.txt") == "mine");
  }
  replace(town, "last");
  check_map(town, "last");
  check_names(folder.path(), {"town"});
}

TEST_CASE("a folder that may not be written, or a file in its place, is told before anything is written") {
  const TemporaryFolder folder;
  put(folder / "town", "a file");
  CHECK_THROWS_WITH(StagedFolder(folder / "town"), Contains("a file is in the way"));
  CHECK(content_of(folder / "town") == "a file");
  CHECK_THROWS_AS(StagedFolder("/proc/town"), OutputError);
}

TEST_CASE("what is said of a file in the staging folder names the folder that the user knows") {
  const TemporaryFolder folder;
  const StagedFolder stage(folder / "town");
  CHECK(stage.renamed((stage.staging() / "map.ply").string() + ": full") ==
        (folder / "town/map.ply").string() + ": full");
}
