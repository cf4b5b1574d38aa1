#include "alces_drivers/notice_rate_limiter.h"

#include <catch2/catch.hpp>

#include "notice_log.h"

using namespace alces;

namespace {

enum class Kind : std::uint8_t { first, second, count };

}  // namespace

TEST_CASE(
    "a notice of something that goes on is told less and less often, and again at once after a silence") {
  NoticeLog log;
  NoticeRateLimiter<Kind> notices(log, "part");
  const auto told_at = [&log](std::int64_t begin_ms, std::int64_t end_ms, auto&& raise) {
    log.notices.clear();
    for (std::int64_t ms = begin_ms; ms < end_ms; ms += 100) raise(ms * ns_per_ms);
    std::vector<std::int64_t> seconds;
    for (const Notice& notice : log.notices) seconds.push_back(notice.stamp_ns / ns_per_s);
    return seconds;
  };
  const auto raise = [&notices](std::int64_t stamp_ns) {
    notices.raise(Kind::first, Severity::warning, stamp_ns, "goes on", 7);
  };
  CHECK(told_at(0, 300'000, raise) == std::vector<std::int64_t>{0, 1, 3, 7, 15, 31, 63, 127, 191, 255});
  CHECK(notices.held_back() == 3000 - 10);
  CHECK(told_at(305'000, 306'000, raise).empty());  // five seconds are no silence
  CHECK(told_at(316'000, 320'000, raise) == std::vector<std::int64_t>{316, 317, 319});

  // The other kind, one that comes every 2 s, a clock that was set back.
  notices.raise(Kind::second, Severity::info, 320 * ns_per_s, "another");
  CHECK(std::string(log.notices.back().text) == "another");
  CHECK(told_at(0, 1000, raise) == std::vector<std::int64_t>{0});
}

TEST_CASE("what comes every two seconds is told less often as well") {
  NoticeLog log;
  NoticeRateLimiter<Kind> notices(log, "part");
  for (std::int64_t s = 0; s < 600; s += 2) notices.raise(Kind::first, Severity::info, s * ns_per_s, "again");
  CHECK(log.notices.size() < 20);
  CHECK(log.notices.size() > 10);
}
