// GpioLines on a chip that the kernel simulates (gpio-sim): needs root and the module, and says so where they
// are missing.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <thread>

#include "alces_platform/linux/gpio/gpio_lines.h"
#include "linux_support.h"

using namespace alces;
using alces::test::LoopBench;

namespace {

namespace fs = std::filesystem;

const fs::path simulator = "/sys/kernel/config/gpio-sim";

/// A chip of four lines, the third of them named, for as long as the object lives.
class SimulatedChip {
 public:
  std::string name;

  SimulatedChip() {
    fs::create_directories(chip_ / "bank0" / "line2");
    put(chip_ / "bank0" / "num_lines", "4");
    put(chip_ / "bank0" / "label", "alces-test-chip");
    put(chip_ / "bank0" / "line2" / "name", "encoder-index");
    plug();
  }
  ~SimulatedChip() {
    unplug();
    fs::remove(chip_ / "bank0" / "line2");
    fs::remove(chip_ / "bank0");
    fs::remove(chip_);
  }
  void plug() {
    put(chip_ / "live", "1");
    name = get(chip_ / "bank0" / "chip_name");
    lines_ = fs::path("/sys/devices/platform") / get(chip_ / "dev_name") / name;
    REQUIRE(fs::exists(lines_));
    for (int i = 0; i < 100 && !fs::exists("/dev/" + name); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  void unplug() const { put(chip_ / "live", "0"); }
  void set(int line, bool is_high) const {
    put(lines_ / ("sim_gpio" + std::to_string(line)) / "pull", is_high ? "pull-up" : "pull-down");
    // The simulated interrupt comes from a work queue: two changes in haste would be one edge.
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }

 private:
  static void put(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }
  static std::string get(const fs::path& file) {
    std::string text;
    std::ifstream(file) >> text;
    return text;
  }
  fs::path chip_ = simulator / "alces-test";
  fs::path lines_;
};

bool is_simulator_here() {
  std::error_code ignored;
  if (fs::exists(simulator, ignored)) return true;
  WARN("skipped: no gpio-sim here (modprobe gpio-sim, configfs mounted, root)");
  return false;
}

}  // namespace

TEST_CASE("edges of a simulated chip come as events, in order, with the time they happened") {
  if (!is_simulator_here()) return;
  const SimulatedChip chip;
  LoopBench bench;
  const std::vector<GpioLine> lines{{.line = "1"}, {.line = "encoder-index", .edges = GpioEdges::rising}};
  GpioLines gpio(bench.loop, {.chip = "alces-test-chip", .lines = lines, .first_line = 3});
  const bool is_open = gpio.open();
  INFO(gpio.error());
  REQUIRE(is_open);
  const std::int64_t before_ns = now_ns();
  for (int i = 0; i < 3; ++i) {
    chip.set(1, true);
    chip.set(2, true);
    chip.set(1, false);
    chip.set(2, false);
  }
  REQUIRE(bench.run_until([&] { return gpio.counters().edges >= 9; }));
  bench.run_for(30 * ns_per_ms);
  const auto edges = bench.sink.of(EventKind::edge);
  REQUIRE(edges.size() == 9);
  std::string order;
  std::int64_t last_ns = before_ns;
  std::uint32_t sequence = 0;
  for (const auto& kept : edges) {
    const GpioEdge& edge = kept.event.edge;
    order += edge.line == 4 ? "I" : (edge.is_rising ? "r" : "f");
    CHECK((edge.line == 3 || edge.line == 4));
    CHECK(kept.event.stamp_ns >= last_ns);
    last_ns = kept.event.stamp_ns;
    if (edge.line == 3 && GpioRequest::has_sequence_numbers()) CHECK(edge.sequence == ++sequence);
  }
  CHECK(order == "rIfrIfrIf");
  CHECK(last_ns <= now_ns());
  CHECK(gpio.counters().losses == 0);
  CHECK(gpio.counters().implausible_stamps == 0);
}

TEST_CASE("edges that the kernel had no room for are reported as lost") {
  if (!is_simulator_here()) return;
  const SimulatedChip chip;
  LoopBench bench;
  const std::vector<GpioLine> lines{{.line = "0"}, {.line = "1"}};
  GpioLines gpio(bench.loop, {.chip = chip.name.c_str(), .lines = lines});
  REQUIRE(gpio.open());
  const int made = GpioRequest::has_sequence_numbers() ? 2000 : 33;
  for (int i = 0; i < made; ++i) chip.set(0, i % 2 == 0);
  bench.run_for(50 * ns_per_ms);
  const auto lost = bench.sink.of(EventKind::edges_lost);
  REQUIRE_FALSE(lost.empty());
  CHECK(lost[0].event.edge.line == 0);
  CHECK(gpio.counters().edges < static_cast<std::uint64_t>(made));
  if (GpioRequest::has_sequence_numbers()) {
    CHECK(gpio.counters().edges + gpio.counters().edges_lost == static_cast<std::uint64_t>(made));
  }
  CHECK(bench.notices.count("edges were lost") == 1);
}

TEST_CASE("lines that cannot be had are refused with the line and the reason") {
  if (!is_simulator_here()) return;
  const SimulatedChip chip;
  LoopBench bench;
  const auto refusal = [&](const char* line) {
    const std::vector<GpioLine> lines{{.line = "3"}, {.line = line}};
    GpioLines gpio(bench.loop, {.chip = chip.name.c_str(), .lines = lines});
    CHECK_FALSE(gpio.open());
    return std::string(gpio.error());
  };
  CHECK(refusal("4").find("has 4 lines, there is no line 4") != std::string::npos);
  CHECK(refusal("no-such-line").find("no line named \"no-such-line\"") != std::string::npos);
  CHECK_FALSE(refusal("3").empty());

  const std::vector<GpioLine> lines{{.line = "0"}};
  GpioLines first(bench.loop, {.chip = chip.name.c_str(), .lines = lines, .consumer = "the other one"});
  REQUIRE(first.open());
  CHECK(refusal("0").find("line 0: in use by \"the other one\"") != std::string::npos);
  first.close();
  const std::vector<GpioLine> both{{.line = "0"}, {.line = "3"}};  // what was refused has been given back
  GpioLines second(bench.loop, {.chip = chip.name.c_str(), .lines = both});
  CHECK(second.open());
}

TEST_CASE("a chip that is unplugged is reported, waited for and used again") {
  if (!is_simulator_here()) return;
  SimulatedChip chip;
  LoopBench bench;
  const std::vector<GpioLine> lines{{.line = "0"}};
  GpioLines gpio(bench.loop, {.chip = "alces-test-chip", .lines = lines});
  REQUIRE(gpio.open());
  chip.unplug();
  REQUIRE(bench.run_until([&] { return !gpio.is_open(); }));
  CHECK(bench.notices.count("the GPIO chip is gone") == 1);
  CHECK(bench.sink.of(EventKind::edges_lost).size() == 1);
  chip.plug();
  REQUIRE(bench.run_until([&] { return gpio.is_open(); }));
  chip.set(0, true);
  CHECK(bench.run_until([&] { return gpio.counters().edges == 1; }));
  CHECK(gpio.counters().opens == 2);
}
