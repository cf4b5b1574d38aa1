#include "alces_drivers/stamp.h"

#include <catch2/catch.hpp>

using namespace alces;

TEST_CASE("stamps that can be are those within 73 years of the clock's beginning") {
  CHECK(is_sane_stamp(0));
  CHECK(is_sane_stamp(latest_stamp_ns));
  CHECK_FALSE(is_sane_stamp(-1));
  CHECK_FALSE(is_sane_stamp(no_stamp_ns));
  CHECK_FALSE(is_sane_stamp(latest_stamp_ns + 1));
  CHECK_FALSE(is_sane_stamp(INT64_MAX));
}

TEST_CASE("what is remembered moves with the clock, and never overflows however often it steps") {
  std::int64_t stamp_ns = 100;
  shift_stamp(stamp_ns, -30);
  CHECK(stamp_ns == 70);
  shift_stamp(stamp_ns, 30);
  CHECK(stamp_ns == 100);
  for (int i = 0; i < 10; ++i) shift_stamp(stamp_ns, -latest_stamp_ns);
  CHECK(stamp_ns == -latest_stamp_ns);
  for (int i = 0; i < 10; ++i) shift_stamp(stamp_ns, latest_stamp_ns);
  CHECK(stamp_ns == latest_stamp_ns);
  std::int64_t never_ns = no_stamp_ns;
  shift_stamp(never_ns, 5);
  CHECK(never_ns == no_stamp_ns);
}
