#include "alces/client.h"

#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <fstream>

#include "client/page_in_file.h"

using namespace alces::test;

namespace {

/// What the child returns; -1: it was killed.
template <typename Work>
int in_child(Work work) {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) ::syscall(SYS_exit, work());  // not exit_group, which strict seccomp kills for
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE("a client that is there before alcesd reads the page as soon as there is one") {
  const PageFolder folder;
  ClientAt client(folder.file());
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_NO_PAGE);
  CHECK(client.status() == ALCES_NO_PAGE);
  CHECK(client.next_event() == ALCES_NO_PAGE);
  PageInFile page(folder.file(), 7);
  page.drive_to(500 * ms);
  client.now_ns = 500 * ms;
  REQUIRE(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);
  CHECK(client.pose.start_id == 7);
  CHECK(client.latest(ALCES_MAP_FROM_ODOM) == ALCES_NOT_YET);
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_NOT_YET);
  CHECK(client.status() == ALCES_NOT_YET);
  CHECK(client.next_event() == ALCES_NO_EVENT);
}

TEST_CASE("files that are no page are named for what they are, and never crash a client") {
  const PageFolder folder;
  const std::string path = folder.file();
  const auto result = [&] {
    ClientAt client(path);
    return client.latest(ALCES_MAP_FROM_BODY);
  };
  SECTION("empty") {
    std::ofstream(path).flush();
    CHECK(result() == ALCES_BAD_PAGE);
  }
  SECTION("something else") {
    std::ofstream(path) << std::string(1'000'000, 'x');
    CHECK(result() == ALCES_BAD_PAGE);
  }
  SECTION("cut off at any length") {
    const PageInFile page(path, 1);
    for (const off_t size : {off_t{sizeof(alces_page)} - 1, off_t{4096}, off_t{64}, off_t{63}, off_t{0}}) {
      REQUIRE(::truncate(path.c_str(), size) == 0);
      CHECK(result() == ALCES_BAD_PAGE);
    }
  }
  SECTION("another version") {
    PageInFile page(path, 1);
    page.page().head.version = ALCES_PAGE_VERSION + 1;
    CHECK(result() == ALCES_OTHER_VERSION);
  }
  SECTION("another size") {
    PageInFile page(path, 1);
    page.page().head.size = 4096;
    CHECK(result() == ALCES_BAD_PAGE);
  }
  SECTION("a folder") {
    REQUIRE(::mkdir(path.c_str(), 0755) == 0);
    CHECK(result() == ALCES_BAD_PAGE);
  }
  SECTION("a pipe, which nobody writes") {
    REQUIRE(::mkfifo(path.c_str(), 0644) == 0);
    CHECK(result() == ALCES_BAD_PAGE);
  }
  SECTION("one that this user may not read") {
    const PageInFile page(path, 1);
    REQUIRE(::chmod(path.c_str(), 0000) == 0);
    REQUIRE(::chmod(std::filesystem::path(path).parent_path().c_str(), 0755) == 0);
    const int got = in_child([&] {
      if (::geteuid() == 0 && ::setresuid(65534, 65534, 65534) != 0) return 1;
      return result() == ALCES_NO_PERMISSION ? 0 : 2;
    });
    CHECK(got == 0);
  }
  CHECK(alces_client_open(std::string(5000, 'x').c_str()) == nullptr);
}

TEST_CASE("arguments that cannot be are refused, and every result has its sentence") {
  CHECK(alces_client_latest(nullptr, ALCES_ODOM_FROM_BODY, nullptr) == ALCES_BAD_ARGUMENT);
  CHECK(alces_client_status(nullptr, nullptr) == ALCES_BAD_ARGUMENT);
  alces_client_close(nullptr);
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.drive_to(0);
  ClientAt client(folder.file());
  CHECK(client.latest(static_cast<alces_transform>(3)) == ALCES_BAD_ARGUMENT);
  CHECK(client.at(static_cast<alces_transform>(3), 0) == ALCES_BAD_ARGUMENT);
  for (int result = ALCES_BAD_ARGUMENT; result <= ALCES_ENDED; ++result)
    CHECK(std::string(alces_client_text(result)) != "unknown");
  CHECK(std::string(alces_client_text(77)) == "unknown");
}

TEST_CASE("a pose is never shown as new when alcesd stands still, the odometry is silent, or it has ended") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.drive_to(10'000 * ms);
  page.correct(10'000 * ms, rigid(0, 0, 0));
  ClientAt client(folder.file());
  client.now_ns = 10'020 * ms;
  REQUIRE(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);
  CHECK(client.pose.age_ns == 20 * ms);
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_OK);

  client.now_ns = 10'501 * ms;
  for (const auto transform : {ALCES_ODOM_FROM_BODY, ALCES_MAP_FROM_ODOM, ALCES_MAP_FROM_BODY}) {
    CHECK(client.latest(transform) == ALCES_STALE);
    CHECK(client.pose.age_ns == 501 * ms);
  }
  page.be_alive(10'501 * ms);  // its thread goes on, and frames do not come
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_STALE);
  CHECK(client.latest(ALCES_MAP_FROM_ODOM) == ALCES_OK);
  page.odometry.is_valid = 0;
  page.odometry.odom_from_body.stamp_ns = 10'501 * ms;
  page.be_alive(10'501 * ms);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_STALE);
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_STALE);

  client.now_ns = 13'100 * ms;  // no scan comes
  page.drive_to(13'100 * ms);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);
  CHECK(client.latest(ALCES_MAP_FROM_ODOM) == ALCES_STALE);
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_STALE);
  CHECK(client.pose.age_ns == 0);

  page.set_state(ALCES_PAGE_ENDED);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_ENDED);
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_ENDED);
  client.now_ns = 5'000 * ms;  // another clock: nothing can be said of an age
  page.set_state(ALCES_PAGE_LIVE);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_STALE);
}

TEST_CASE("a writer that dies, or is held up, in the middle of writing leaves what it said before") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.drive_to(0);
  page.drive_to(20 * ms);
  page.correct(20 * ms, rigid(3, 4, 0));
  ClientAt client(folder.file());
  client.now_ns = 20 * ms;
  REQUIRE(client.latest(ALCES_MAP_FROM_ODOM) == ALCES_OK);
  for (std::uint32_t* const section : {page.page().map, page.page().odometry}) {
    const bool is_map = section == page.page().map;
    const std::size_t words =
        is_map ? ALCES_PAGE_WORDS(struct alces_page_map) : ALCES_PAGE_WORDS(struct alces_page_odometry);
    std::uint32_t* const written = section + alces_page_copy(1 - section[0], words);
    ++written[0];
    written[20] = 0xDEADBEEF;
  }
  CHECK(client.latest(ALCES_MAP_FROM_ODOM) == ALCES_OK);
  CHECK(client.pose.position_m[1] == 4);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);
  CHECK(client.pose.sequence == 2);
}

TEST_CASE("a page on which nothing can be read any more is told, and the call comes back") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.drive_to(0);
  page.correct(0, rigid(0, 0, 0));
  ClientAt client(folder.file());
  REQUIRE(client.latest(ALCES_MAP_FROM_BODY) == ALCES_OK);
  constexpr std::size_t map_words = ALCES_PAGE_WORDS(struct alces_page_map);
  for (const std::uint32_t copy : {0U, 1U}) ++page.page().map[alces_page_copy(copy, map_words)];
  CHECK(client.latest(ALCES_MAP_FROM_BODY) == ALCES_UNSETTLED);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);  // another thread's
  constexpr std::size_t odometry_words = ALCES_PAGE_WORDS(struct alces_page_odometry);
  for (const std::uint32_t copy : {0U, 1U}) ++page.page().odometry[alces_page_copy(copy, odometry_words)];
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_UNSETTLED);
  CHECK(client.status() == ALCES_UNSETTLED);
}

TEST_CASE("a past pose lies between those of the odometry, as exactly as it was driven") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  for (std::int64_t stamp = 0; stamp <= 30'000 * ms; stamp += 20 * ms) page.drive_to(stamp);
  ClientAt client(folder.file());
  client.now_ns = 30'000 * ms;
  for (std::int64_t stamp = 9'580 * ms; stamp <= 30'000 * ms; stamp += 3'333'333) {
    REQUIRE(client.at(ALCES_ODOM_FROM_BODY, stamp) == ALCES_OK);
    const alces_page_rigid truth = PageInFile::on_circle(stamp);
    CHECK(std::abs(client.pose.position_m[0] - truth.position_m[0]) < 5e-5);
    CHECK(std::abs(client.pose.position_m[1] - truth.position_m[1]) < 5e-5);
    const double sign = client.pose.orientation_xyzw[3] * truth.orientation_xyzw[3] < 0 ? -1 : 1;
    CHECK(std::abs(client.pose.orientation_xyzw[2] - sign * truth.orientation_xyzw[2]) < 1e-6);
    CHECK(client.pose.velocity[0] == Approx(1).margin(1e-3));
    CHECK(client.pose.velocity[5] == Approx(0.5).margin(1e-3));
    CHECK(client.pose.is_extrapolated == 0);
  }
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 9'000 * ms) == ALCES_TOO_OLD);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, INT64_MIN / 2) == ALCES_TOO_OLD);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 30'101 * ms) == ALCES_NOT_YET);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, INT64_MAX / 2) == ALCES_NOT_YET);
  REQUIRE(client.at(ALCES_ODOM_FROM_BODY, 30'100 * ms) == ALCES_OK);
  CHECK(client.pose.is_extrapolated == 1);
  const alces_page_rigid truth = PageInFile::on_circle(30'100 * ms);
  CHECK(std::hypot(client.pose.position_m[0] - truth.position_m[0],
                   client.pose.position_m[1] - truth.position_m[1]) < 1e-4);
}

TEST_CASE("where the odometry was away there is no past pose") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.drive_to(0, false);
  page.drive_to(20 * ms);
  page.drive_to(1'000 * ms, false);
  page.drive_to(1'020 * ms);
  ClientAt client(folder.file());
  client.now_ns = 1'020 * ms;
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 0) == ALCES_OK);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 10 * ms) == ALCES_OK);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 20 * ms) == ALCES_OK);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 500 * ms) == ALCES_GAP);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 1'000 * ms) == ALCES_OK);
  CHECK(client.at(ALCES_ODOM_FROM_BODY, 1'010 * ms) == ALCES_OK);
}

TEST_CASE("map -> body is map -> odom and odom -> body, and less sure the farther the odometry carried it") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.odometry.growth = {0.02, 0.01, 0.001, 0.0001, 0.03};
  for (std::int64_t stamp = 0; stamp <= 2'000 * ms; stamp += 20 * ms) page.drive_to(stamp);
  page.correct(1'000 * ms, rigid(10, 20, 1.5707963267948966));
  ClientAt client(folder.file());
  client.now_ns = 2'010 * ms;
  REQUIRE(client.latest(ALCES_MAP_FROM_BODY) == ALCES_OK);
  const alces_page_rigid odom = PageInFile::on_circle(2'000 * ms);
  CHECK(client.pose.position_m[0] == Approx(10 - odom.position_m[1]));
  CHECK(client.pose.position_m[1] == Approx(20 + odom.position_m[0]));
  CHECK(client.pose.stamp_ns == 2'000 * ms);
  CHECK(client.pose.map_stamp_ns == 1'000 * ms);
  CHECK(client.pose.map_sequence == 1);
  const auto variance_m2 = [&] { return client.pose.covariance[0] + client.pose.covariance[7]; };
  const double now_m2 = variance_m2();
  REQUIRE(client.at(ALCES_MAP_FROM_BODY, 1'000 * ms) == ALCES_OK);
  CHECK(variance_m2() == Approx(0.02));  // the scan's own
  CHECK(client.pose.covariance[35] == Approx(0.0001));
  REQUIRE(client.at(ALCES_MAP_FROM_BODY, 1'500 * ms) == ALCES_OK);
  CHECK(variance_m2() > 0.02);
  CHECK(variance_m2() < now_m2);
  // A metre on: its own heading carried it off by 0.01 rad, the way by 2 %.
  CHECK(now_m2 == Approx(0.02 + 1 * 0.0001 + 0.0004).margin(2e-5));
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < row; ++column)
      CHECK(client.pose.covariance[6 * row + column] == Approx(client.pose.covariance[6 * column + row]));
  }
}

TEST_CASE("without odometry map -> body is that of the newest scan, and says so") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.correct(1'000 * ms, rigid(1, 2, 0));
  page.map.map_from_odom = {};
  write_section(page.page().map, page.map);
  page.be_alive(1'500 * ms);
  ClientAt client(folder.file());
  client.now_ns = 1'500 * ms;
  REQUIRE(client.latest(ALCES_MAP_FROM_BODY) == ALCES_OK);
  CHECK(client.pose.is_of_scan == 1);
  CHECK(client.pose.age_ns == 500 * ms);
  CHECK(client.pose.position_m[1] == 2);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_NOT_YET);
  CHECK(client.at(ALCES_MAP_FROM_BODY, 1'000 * ms) == ALCES_NOT_YET);
}

TEST_CASE("a client follows a restart by itself, in order or after a kill, and sees that there was one") {
  const bool was_killed = GENERATE(false, true);
  const PageFolder folder;
  ClientAt client(folder.file());
  PageInFile before(folder.file(), 1);
  before.drive_to(1'000 * ms);
  before.close_loop(1, 2);
  client.now_ns = 1'000 * ms;
  REQUIRE(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);
  CHECK(client.pose.start_id == 1);
  REQUIRE(client.next_event() == ALCES_OK);
  REQUIRE(std::remove(folder.file().c_str()) == 0);
  if (!was_killed) before.set_state(ALCES_PAGE_ENDED);
  client.now_ns = 2'000 * ms;
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == (was_killed ? ALCES_STALE : ALCES_ENDED));

  PageInFile after(folder.file(), 2);
  after.drive_to(2'200 * ms);
  after.close_loop(3, 4);
  client.now_ns = 2'200 * ms;
  REQUIRE(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);
  CHECK(client.pose.start_id == 2);
  CHECK(client.pose.sequence == 1);
  CHECK(client.next_event() == ALCES_RESTARTED);
  REQUIRE(client.next_event() == ALCES_OK);
  CHECK(client.event.first_scan == 3);
  CHECK(client.event.start_id == 2);
  CHECK(client.next_event() == ALCES_NO_EVENT);
}

TEST_CASE("a page that was replaced by one that cannot be read is not shown any longer") {
  const PageFolder folder;
  PageInFile before(folder.file(), 1);
  before.drive_to(0);
  ClientAt client(folder.file());
  REQUIRE(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OK);
  PageInFile after(folder.file(), 2);
  after.page().head.version = 99;
  before.set_state(ALCES_PAGE_REPLACED);
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_ENDED);  // looked for 0 ms ago
  client.now_ns = 100 * ms;
  CHECK(client.latest(ALCES_ODOM_FROM_BODY) == ALCES_OTHER_VERSION);
}

TEST_CASE("events come once each and in order, and those that were overwritten are missed aloud") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.be_alive(0);
  ClientAt client(folder.file());
  for (std::uint32_t i = 0; i < 3; ++i) page.close_loop(i, i + 100);
  for (std::uint32_t i = 0; i < 3; ++i) {
    REQUIRE(client.next_event() == ALCES_OK);
    CHECK(client.event.sequence == i + 1);
    CHECK(client.event.first_scan == i);
    CHECK(client.event.last_scan == i + 100);
    CHECK(client.event.is_closed == 1);
    CHECK(client.event.correction_m == 0.25);
    CHECK(std::string(client.event.verdict) == "closed");
  }
  CHECK(client.next_event() == ALCES_NO_EVENT);
  for (std::uint32_t i = 3; i < 103; ++i) page.close_loop(i, 0);
  CHECK(client.next_event() == ALCES_EVENTS_LOST);
  std::uint32_t got = 0;
  std::uint64_t last = 0;
  while (client.next_event() == ALCES_OK) {
    CHECK((last == 0 || client.event.sequence == last + 1));
    last = client.event.sequence;
    ++got;
  }
  CHECK(last == 103);
  CHECK(got >= ALCES_PAGE_EVENTS - 1);
  ClientAt late(folder.file());
  REQUIRE(late.next_event() == ALCES_OK);
  CHECK(late.event.sequence == 103 - ALCES_PAGE_EVENTS + 1);
}

TEST_CASE("a reader makes no system call") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  for (std::int64_t stamp = 0; stamp <= 1'000 * ms; stamp += 20 * ms) page.drive_to(stamp);
  page.correct(1'000 * ms, rigid(0, 0, 0));
  page.close_loop(1, 2);
  alces_page_status status{};
  status.updated_ns = 1;
  write_section(page.page().status, status);
  ClientAt client(folder.file());
  client.now_ns = 1'000 * ms;
  REQUIRE(client.latest(ALCES_MAP_FROM_BODY) == ALCES_OK);
  const auto read_everything = [&] {
    return client.latest(ALCES_MAP_FROM_BODY) == ALCES_OK &&
           client.at(ALCES_MAP_FROM_BODY, 500 * ms) == ALCES_OK && client.status() == ALCES_OK &&
           client.next_event() == ALCES_OK;
  };
  CHECK(in_child([&] {
          if (::prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) return 2;
          return read_everything() ? 0 : 1;  // a system call kills it
        }) == 0);
}
