#include "alces_onboard/page/page_file.h"

#include <grp.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <memory>

#include "alces_onboard/error.h"
#include "alces_onboard/page/live_page.h"
#include "client/page_in_file.h"

using namespace alces;
using namespace alces::onboard;
using namespace alces::test;
using Catch::Matchers::Contains;

namespace {

settings::PageSettings page_at(const std::string& path) {
  settings::PageSettings settings;
  settings.path = path;
  return settings;
}

std::string refusal(const settings::PageSettings& settings, ExitStatus expected) {
  try {
    const PageFile file(settings);
  } catch (const Error& error) {
    CHECK(error.exit_status() == expected);
    return error.what();
  }
  return "";
}

std::size_t files_in(const PageFolder& folder) {
  const auto path = std::filesystem::path(folder.file()).parent_path();
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path), {}));
}

}  // namespace

TEST_CASE("a page is whole when it has its name, may be read by a group, and written by nobody else") {
  const PageFolder folder;
  settings::PageSettings settings = page_at(folder.file());
  settings.mode = GENERATE("0600", "0640", "0644");
  if (::geteuid() == 0) settings.group = ::getgrgid(1)->gr_name;
  const PageFile file(settings);
  struct stat status {};
  REQUIRE(::stat(folder.file().c_str(), &status) == 0);
  CHECK((status.st_mode & 07777) == std::stoul(settings.mode, nullptr, 8));
  if (::geteuid() == 0) CHECK(status.st_gid == 1);
  CHECK(status.st_size == sizeof(alces_page));
  CHECK(status.st_blocks * 512 >= status.st_size);  // no store finds that there is no memory
  CHECK(files_in(folder) == 1);
  ClientAt client(folder.file());
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_NOT_YET);
}

TEST_CASE("a page that cannot be is refused with file and remedy, and leaves nothing behind") {
  const PageFolder folder;
  settings::PageSettings settings = page_at(folder.file());
  SECTION("a folder that there is not") {
    settings.path = folder.file("absent/page");
    CHECK_THAT(refusal(settings, ExitStatus::device),
               Contains("absent/page: the page cannot be made (No such file") && Contains("tmpfs"));
    CHECK(files_in(folder) == 0);
  }
  SECTION("another program's file") {
    std::ofstream(settings.path) << "something that somebody needs";
    CHECK_THAT(refusal(settings, ExitStatus::configuration), Contains("another program's file"));
    CHECK(std::filesystem::file_size(settings.path) == 29);
    CHECK(files_in(folder) == 1);
  }
  SECTION("a group that there is not") {
    settings.group = "no-such-group";
    CHECK_THAT(refusal(settings, ExitStatus::configuration), Contains("no group no-such-group"));
    CHECK(files_in(folder) == 0);
  }
  SECTION("a folder on a disk") {
    struct statfs system {};
    REQUIRE(::statfs(".", &system) == 0);
    if (system.f_type == 0x01021994) return;  // it is tmpfs, too
    settings.path = (std::filesystem::current_path() / "page_file_test_page").string();
    CHECK_THAT(refusal(settings, ExitStatus::configuration), Contains("must lie in memory"));
    CHECK_FALSE(std::filesystem::exists(settings.path));
  }
  SECTION("one that another alcesd writes") {
    const PageFile other(settings);
    CHECK_THAT(refusal(settings, ExitStatus::device), Contains("another alcesd writes this page"));
    ClientAt client(settings.path);
    CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_NOT_YET);  // not ended, not replaced
  }
}

TEST_CASE("readers are told of the end, and follow the next start whatever ended the one before") {
  const bool is_killed = GENERATE(false, true);
  const PageFolder folder;
  ClientAt client(folder.file());
  const auto say_something = [](PageFile& file, std::int64_t now_ns) {
    LivePage page(file.page());
    MapPose pose;
    pose.stamp_ns = now_ns;
    page.publish_pose(pose, now_ns);
    page.publish_odometry(nullptr, {}, now_ns);
  };
  if (is_killed) {
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      const auto file = std::make_unique<PageFile>(page_at(folder.file()));
      say_something(*file, ns_per_s);
      ::_exit(0);  // no destructor
    }
    REQUIRE(::waitpid(child, nullptr, 0) == child);
  } else {
    PageFile file(page_at(folder.file()));
    say_something(file, ns_per_s);
  }
  client.now_ns = ns_per_s;
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == (is_killed ? ALCES_OK : ALCES_ENDED));
  const std::uint64_t before = client.pose.start_id;

  PageFile next(page_at(folder.file()));
  say_something(next, ns_per_s);
  client.now_ns = ns_per_s + 100 * ns_per_ms;  // no silence: it is told
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_OK);
  CHECK(client.pose.start_id != before);
  next.end();
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_ENDED);
}
