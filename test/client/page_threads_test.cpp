// A writer and readers that hammer the page: no reader ever has half of one write and half of another.
#include <atomic>
#include <thread>
#include <vector>

#include "client/page_in_file.h"

using namespace alces::test;

TEST_CASE("readers of a section that is written all the time get whole payloads, and never an older one") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  constexpr std::size_t words = ALCES_PAGE_WORDS(struct alces_page_map);
  std::atomic<bool> is_over{false};
  std::atomic<std::uint64_t> torn{0};
  std::atomic<std::uint64_t> backward{0};
  std::atomic<std::uint64_t> whole{0};
  std::vector<std::thread> readers;
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&] {
      std::uint32_t last = 0;
      std::array<std::uint32_t, words> payload;
      while (!is_over.load(std::memory_order_relaxed)) {
        if (alces_page_read(page.page().map, payload.data(), words) == 0) continue;
        for (const std::uint32_t word : payload) torn += word != payload[0] ? 1U : 0U;
        backward += payload[0] < last ? 1U : 0U;
        last = payload[0];
        ++whole;
      }
    });
  }
  std::array<std::uint32_t, words> payload;
  for (std::uint32_t n = 1; n <= 50'000 || whole < 1000; ++n) {
    payload.fill(n);
    alces_page_write(page.page().map, payload.data(), words);
    if (n % 64 == 0) std::this_thread::yield();
  }
  is_over = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(torn == 0);
  CHECK(backward == 0);
  CHECK(whole >= 1000);
}

TEST_CASE("past poses that are asked for while they are written are those that were driven") {
  const PageFolder folder;
  PageInFile page(folder.file(), 1);
  page.drive_to(0);
  std::atomic<std::int64_t> driven_ns{0};
  std::atomic<bool> is_over{false};
  std::atomic<std::uint64_t> wrong{0};
  std::atomic<std::uint64_t> right{0};
  std::atomic<std::uint64_t> other{0};
  std::array<ClientAt, 2> clients{ClientAt(folder.file()), ClientAt(folder.file())};
  std::vector<std::thread> readers;
  for (std::size_t i = 0; i < clients.size(); ++i) {
    readers.emplace_back([&, i] {
      ClientAt& client = clients[i];
      std::int64_t back_ns = 0;
      while (!is_over.load(std::memory_order_relaxed)) {
        client.now_ns = driven_ns.load();
        back_ns = (back_ns + 7'919'113 * static_cast<std::int64_t>(i + 1)) % (20'000 * ms);
        const std::int64_t stamp_ns = std::max<std::int64_t>(0, client.now_ns - back_ns);
        const int result = client.at(ALCES_ODOM_FROM_BODY, stamp_ns);
        if (result != ALCES_OK) {  // overwritten meanwhile, or written far on
          other += result != ALCES_TOO_OLD && result != ALCES_STALE && result != ALCES_UNSETTLED ? 1U : 0U;
          continue;
        }
        const alces_page_rigid truth = PageInFile::on_circle(stamp_ns);
        const double off_m = std::hypot(client.pose.position_m[0] - truth.position_m[0],
                                        client.pose.position_m[1] - truth.position_m[1]);
        wrong += off_m < 1e-3 ? 0U : 1U;
        ++right;
      }
    });
  }
  for (std::int64_t n = 1; n <= 10'000 || right < 1000; ++n) {
    page.drive_to(n * 20 * ms);
    driven_ns = n * 20 * ms;
    if (n % 16 == 0) std::this_thread::yield();
  }
  is_over = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(wrong == 0);
  CHECK(other == 0);
  CHECK(right >= 1000);
}
