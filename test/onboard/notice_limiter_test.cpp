#include "alces_onboard/notice_limiter.h"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

using namespace alces;
using namespace alces::onboard;

namespace {

Notice notice(const char* source, std::int64_t stamp_ns, Severity severity = Severity::warning) {
  return {stamp_ns, severity, source, "something", 0, false};
}

}  // namespace

TEST_CASE(
    "a source that raises thousands is held back to a burst and one every two seconds, and it is counted") {
  NoticeLimiter limiter;
  std::uint64_t passed = 0;
  std::uint64_t told = 0;
  std::uint64_t held_back = 0;
  for (std::int64_t i = 0; i < 70'000; ++i) {  // 7,000 a second, for 10 s
    if (!limiter.may(notice("motor", ns_per_s + i * ns_per_s / 7000), held_back)) continue;
    ++passed;
    told += held_back;
  }
  CHECK(passed == NoticeLimiter::burst + 4);
  CHECK(told > 50'000);
  // Others are not kept from speaking, nor is the same source about something worse.
  CHECK(limiter.may(notice("laser a", 11 * ns_per_s), held_back));
  CHECK(held_back == 0);
  CHECK(limiter.may(notice("motor", 11 * ns_per_s - 1, Severity::error), held_back));
  // A source that has calmed down has its burst again.
  passed = 0;
  for (int i = 0; i < 100; ++i)
    passed += limiter.may(notice("motor", 1000 * ns_per_s + i), held_back) ? 1U : 0U;
  CHECK(passed == NoticeLimiter::burst);
}

TEST_CASE("a source that speaks now and then is never held back") {
  NoticeLimiter limiter;
  std::uint64_t held_back = 0;
  for (int i = 0; i < 1000; ++i) CHECK(limiter.may(notice("gps", i * 3 * ns_per_s), held_back));
}

TEST_CASE("a clock that goes back, and more sources than there is room for, hold nothing up for ever") {
  NoticeLimiter limiter;
  std::uint64_t held_back = 0;
  for (int i = 0; i < 100; ++i) static_cast<void>(limiter.may(notice("motor", 1000 * ns_per_s), held_back));
  CHECK_FALSE(limiter.may(notice("motor", ns_per_s), held_back));
  CHECK(limiter.may(notice("motor", 4 * ns_per_s), held_back));
  CHECK(held_back > 50);
  std::vector<std::string> names;
  for (int i = 0; i < 100; ++i) names.push_back("source " + std::to_string(i));
  std::uint64_t passed = 0;
  for (const std::string& name : names)
    passed += limiter.may(notice(name.c_str(), 5 * ns_per_s), held_back) ? 1U : 0U;
  CHECK(passed >= NoticeLimiter::capacity - 1);
}
