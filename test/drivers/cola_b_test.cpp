#include "alces_drivers/cola_b/cola_b.h"

#include <algorithm>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/test_data.h"

using namespace alces::cola_b;
using alces::ColaB;
using alces::ColaBConfig;
using alces::LaserState;
using alces::ns_per_ms;
using alces::ns_per_s;
using alces::Profile;
using Bytes = std::vector<std::uint8_t>;

namespace {

struct Packet {
  std::int64_t stamp_ns = 0;
  Bytes bytes;
};

/// The TCP payloads of one of the captures, in order; empty: there are no such data. The captures hold TCP's
/// retransmissions but no sequence numbers: scan data that repeat byte for byte, times included, are those.
std::vector<Packet> capture(const std::string& name) {
  std::vector<Packet> packets;
  if (!alces::test::has_test_data("sick/" + name)) return packets;
  std::ifstream file(alces::test::test_data("sick/" + name));
  for (const auto& entry : nlohmann::json::parse(file)) {
    const auto& tcp = entry["_source"]["layers"]["tcp"];
    Packet packet;
    packet.stamp_ns =
        std::llround(std::stod(tcp["Timestamps"]["tcp.time_relative"].get<std::string>()) * 1e9);
    const auto hex = tcp["tcp.payload"].get<std::string>();
    for (std::size_t i = 0; i + 1 < hex.size(); i += 3) {
      packet.bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
    }
    const bool is_again =
        packet.bytes.size() > 1000 &&
        std::any_of(packets.begin(), packets.end(), [&](const Packet& p) { return p.bytes == packet.bytes; });
    if (!is_again) packets.push_back(packet);
  }
  return packets;
}

/// What TCP port 2112 sent in a little-endian pcapng file of Ethernet frames, by sequence number, each byte
/// once.
std::vector<Packet> pcapng_stream(const std::string& name) {
  std::vector<Packet> packets;
  if (!alces::test::has_test_data("sick/" + name)) return packets;
  std::ifstream file(alces::test::test_data("sick/" + name), std::ios::binary);
  const Bytes bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto little = [&](std::size_t at) -> std::uint32_t {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | bytes.at(at + i);
    return value;
  };
  const auto big = [&](std::size_t at, std::size_t count) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value = value << 8 | bytes.at(at + i);
    return value;
  };
  std::map<std::uint32_t, Packet> by_sequence;
  for (std::size_t block = 0; block + 12 <= bytes.size(); block += little(block + 4)) {
    constexpr std::uint32_t enhanced_packet = 6;
    const std::size_t ip = block + 28 + 14;
    if (little(block) != enhanced_packet || big(ip - 2, 2) != 0x0800 || big(ip + 9, 1) != 6) continue;
    const std::size_t tcp = ip + (big(ip, 1) & 15U) * 4;
    const std::size_t data = tcp + (big(tcp + 12, 1) >> 4) * 4;
    const std::size_t end = ip + big(ip + 2, 2);
    if (big(tcp, 2) != 2112 || end == data) continue;
    Packet packet;
    packet.stamp_ns =
        static_cast<std::int64_t>(static_cast<std::uint64_t>(little(block + 12)) << 32 | little(block + 16));
    packet.bytes.assign(bytes.begin() + static_cast<std::ptrdiff_t>(data),
                        bytes.begin() + static_cast<std::ptrdiff_t>(end));
    by_sequence.try_emplace(big(tcp + 4, 4), packet);
  }
  std::uint32_t next = by_sequence.empty() ? 0 : by_sequence.begin()->first;
  for (const auto& [sequence, packet] : by_sequence) {
    REQUIRE(sequence == next);
    next += static_cast<std::uint32_t>(packet.bytes.size());
    packets.push_back(packet);
  }
  return packets;
}

Bytes frame(const Bytes& payload) {
  Bytes out(payload.size() + frame_overhead_bytes);
  REQUIRE(build_frame(payload, out) == out.size());
  return out;
}

Bytes bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

std::vector<Bytes> parse(FrameParser& parser, std::span<const std::uint8_t> bytes, std::size_t piece) {
  std::vector<Bytes> payloads;
  while (!bytes.empty()) {
    const std::size_t taken = parser.push(bytes.first(std::min(piece, bytes.size())));
    REQUIRE(taken > 0);
    bytes = bytes.subspan(taken);
    while (const auto payload = parser.next()) payloads.emplace_back(payload->begin(), payload->end());
  }
  return payloads;
}

void put(Bytes& bytes, std::uint32_t value, std::size_t count) {
  for (std::size_t i = count; i-- > 0;)
    bytes.push_back(
        static_cast<std::uint8_t>(std::uint64_t{value} >> (8 * std::min<std::size_t>(i, 7)) & 0xff));
}

struct Fake {
  std::uint16_t telegram_counter = 1;
  int layer_angle = 0;
  std::uint32_t start_us = 1000;
  std::uint32_t transmission_us = 42000;
  std::uint32_t count = 3;
  std::uint32_t channels = 2;
  std::string content = "DIST1";
  float scale = 1;
};

Bytes scan_payload(const Fake& fake) {
  Bytes bytes = bytes_of("sSN LMDscandata ");
  put(bytes, 1, 2);
  put(bytes, 1, 2);
  put(bytes, 4711, 4);
  put(bytes, 0, 2);
  put(bytes, fake.telegram_counter, 2);
  put(bytes, fake.telegram_counter, 2);
  put(bytes, fake.start_us, 4);
  put(bytes, fake.transmission_us, 4);
  put(bytes, 0, 4);
  put(bytes, static_cast<std::uint32_t>(fake.layer_angle) & 0xFFFF, 2);
  put(bytes, 2500, 4);
  put(bytes, 540, 4);
  put(bytes, 1, 2);  // an encoder
  put(bytes, 0x12345678, 4);
  put(bytes, 77, 2);
  put(bytes, fake.channels, 2);
  for (std::uint32_t channel = 0; channel < fake.channels; ++channel) {
    // Remission first: DIST1 must be found by name.
    const Bytes name = bytes_of(channel + 1 == fake.channels ? fake.content : "RSSI1");
    bytes.insert(bytes.end(), name.begin(), name.end());
    put(bytes, std::bit_cast<std::uint32_t>(fake.scale), 4);
    put(bytes, 0, 4);
    put(bytes, static_cast<std::uint32_t>(-50000), 4);
    put(bytes, 5000, 2);
    put(bytes, fake.count, 2);
    for (std::uint32_t i = 0; i < fake.count; ++i) put(bytes, i == 1 ? 3 : 1000 + i, 2);
  }
  put(bytes, 0, 12);
  return bytes;
}

/// The driver with a device that answers from a table.
class Rig final : public alces::BytePort, public alces::NoticePort, public alces::ProfileSink {
 public:
  explicit Rig(const ColaBConfig& config) : driver(config, *this, *this, *this) {}

  bool write(std::span<const std::uint8_t> bytes) override {
    FrameParser parser;
    for (const Bytes& payload : parse(parser, bytes, bytes.size())) {
      requests.emplace_back(payload.begin(), payload.end());
      const std::string name = requests.back().substr(4, requests.back().find(' ', 4) - 4);
      if (const auto answer = answers.find(name); answer != answers.end()) waiting.push_back(answer->second);
    }
    return true;
  }
  bool set_baud_rate(std::uint32_t) override { return true; }
  void drop() override { ++drops; }
  void raise(const alces::Notice& notice) override {
    notices.emplace_back(notice.text);
    if (notice.has_value) values.push_back(notice.value);
  }
  void on_profile(const Profile& profile) override { profiles.push_back(profile); }

  void run(double seconds) {
    const std::int64_t end_ns = now_ns + std::llround(seconds * 1e9);
    for (; now_ns < end_ns; now_ns += 10 * ns_per_ms) {
      driver.on_tick(now_ns);
      while (!waiting.empty()) {
        const Bytes bytes = waiting.front();
        waiting.pop_front();
        driver.on_bytes(bytes, now_ns);
      }
    }
  }
  void answer(const std::string& name, const std::string& text) { answers[name] = frame(bytes_of(text)); }
  void answer_everything() {
    using namespace std::string_literals;
    answer("SetAccessMode", "sAN SetAccessMode \1"s);
    answer("mLMPsetscancfg", "sAN mLMPsetscancfg \0"s);
    answer("LMDscandatacfg", "sWA LMDscandatacfg"s);
    answer("LMCstartmeas", "sAN LMCstartmeas \0"s);
    answer("Run", "sAN Run \1"s);
    answer("STlms", "sRA STlms \0\7\0"s);
    answer("LMPoutputRange",
           "sRA LMPoutputRange \0\1\0\0\x13\x88\xff\xf9\x22\x30\0\x22\x55\x10"s);  // 541 rays
    answer("LMDscandata", "sEA LMDscandata \1"s);
  }
  [[nodiscard]] bool was_told(const std::string& what) const {
    return std::any_of(notices.begin(), notices.end(),
                       [&](const std::string& text) { return text.find(what) != std::string::npos; });
  }

  ColaB driver;
  std::int64_t now_ns = 50 * ns_per_s;
  std::map<std::string, Bytes> answers;
  std::deque<Bytes> waiting;
  std::vector<std::string> requests;
  std::vector<std::string> notices;
  int drops = 0;
  std::vector<std::int64_t> values;  ///< of those notices that have one
  std::vector<Profile> profiles;
};

}  // namespace

TEST_CASE("frames are found wherever the stream is split, and good ones behind broken ones") {
  const std::size_t piece = GENERATE(1U, 2U, 7U, 4096U);
  FrameParser parser;
  Bytes broken = frame(bytes_of("sRA broken"));
  broken[10] ^= 1;
  Bytes bytes{0x00, 0x02, 0x02, 0x41};
  const auto append = [&](const Bytes& more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
  append(broken);
  append(frame(bytes_of("sAN Run \1")));
  append({0x02, 0x02, 0x02, 0x02, 0x00, 0x10, 0x00, 0x00});  // a megabyte is promised
  append({0x02, 0x02, 0x02, 0x02, 0x00, 0x00, 0x00, 0x00});  // nothing is
  append({0x02});                                            // five STX in a row
  append(frame(bytes_of("sEA LMDscandata \1")));
  const auto payloads = parse(parser, bytes, piece);
  REQUIRE(payloads.size() == 2);
  CHECK(payloads[0] == bytes_of("sAN Run \1"));
  CHECK(payloads[1] == bytes_of("sEA LMDscandata \1"));
  CHECK(parser.counters().checksum_errors == 1);
  CHECK(parser.counters().bad_lengths >= 2);
  CHECK(parser.pending_bytes() == 0);
}

TEST_CASE("the longest frame passes, a longer one is not built, random bytes do no harm") {
  FrameParser parser;
  const Bytes longest(maximum_payload_bytes, 's');
  CHECK(parse(parser, frame(longest), 1000).size() == 1);
  Bytes out(maximum_payload_bytes + 100);
  CHECK(build_frame(Bytes(maximum_payload_bytes + 1), out) == 0);
  CHECK(build_frame({}, out) == 0);
  alces::sim::Random random(5);
  Bytes noise;
  for (int i = 0; i < 100'000; ++i) {
    noise.push_back(random.chance(0.6) ? std::uint8_t{2} : static_cast<std::uint8_t>(random.integer(0, 255)));
  }
  parse(parser, noise, 333);
  parser.discard();
  parser.allow_work();
  CHECK(parse(parser, frame(bytes_of("sAN Run \1")), 5).size() == 1);
}

/// What a hostile peer sends: headers that promise 16 KiB, over and over; perhaps with a command's first
/// letter.
Bytes false_headers(std::size_t count, bool has_letter) {
  Bytes header{0x02, 0x02, 0x02, 0x02, 0x00, 0x00, 0x3F, 0xF8};
  if (has_letter) header.push_back('s');
  Bytes bytes;
  bytes.reserve(count * header.size());
  for (std::size_t i = 0; i < count; ++i) bytes.insert(bytes.end(), header.begin(), header.end());
  return bytes;
}

TEST_CASE("false headers cost a bounded amount of work until time passes, and good frames pass after that") {
  FrameParser parser;
  const Bytes flood = false_headers(100'000, true);
  CHECK(parse(parser, flood, 1000).empty());
  CHECK(parser.counters().overloads == 1);
  // Each sum of 16 KiB is one checksum error: without a bound there would be 98,000.
  CHECK(parser.counters().checksum_errors <= FrameParser::work_limit_bytes / maximum_payload_bytes);
  CHECK(parser.counters().bytes_skipped == flood.size());
  CHECK(parse(parser, frame(bytes_of("sAN Run \1")), 5).empty());
  parser.allow_work();
  CHECK(parse(parser, frame(bytes_of("sAN Run \1")), 5).size() == 1);
  CHECK(parser.counters().overloads == 1);
}

TEST_CASE("a peer that sends only garbage is told once and dropped each time, and makes sense again later") {
  Rig rig({.is_listen_only = true});
  rig.driver.start(rig.now_ns);
  rig.driver.on_link(true, rig.now_ns);
  const Bytes flood = false_headers(2048, false);  // 16 KiB, as a connection reads at once
  for (int i = 0; i < 40; ++i) {
    rig.driver.on_bytes(flood, rig.now_ns);
    rig.run(0.01);
  }
  CHECK(rig.driver.counters().peers_dropped == 2);  // 640 KiB
  CHECK(rig.drops == 2);
  CHECK(std::ranges::count_if(rig.notices, [](const std::string& text) {
          return text.find("nothing but garbage comes") != std::string::npos;
        }) == 1);
  rig.run(0.01);
  rig.driver.on_bytes(frame(scan_payload({})), rig.now_ns);
  CHECK(rig.profiles.size() == 1);
  // A laser that sends a broken frame now and then is none of those.
  for (int i = 0; i < 40; ++i) {
    rig.driver.on_bytes(flood, rig.now_ns);
    rig.run(0.01);
    rig.driver.on_bytes(frame(scan_payload({.telegram_counter = static_cast<std::uint16_t>(i + 2)})),
                        rig.now_ns);
    rig.run(0.01);
  }
  CHECK(rig.drops == 2);
}

TEST_CASE("a laser of several layers is refused by name, with its middle layer") {
  Rig rig({.is_listen_only = true});
  rig.driver.start(rig.now_ns);
  rig.driver.on_bytes(frame(scan_payload({.telegram_counter = 1})), rig.now_ns);
  CHECK(rig.profiles.size() == 1);  // so far it may be any
  const std::size_t told = rig.notices.size();
  for (std::uint16_t i = 2; i < 42; ++i) {
    constexpr int layers[] = {-500, 0, 250, -250};
    rig.driver.on_bytes(frame(scan_payload({.telegram_counter = i, .layer_angle = layers[i % 4]})),
                        rig.now_ns);
  }
  CHECK(rig.profiles.size() == 1);
  CHECK(rig.driver.counters().layers_refused == 40);
  CHECK(rig.was_told("the laser scans in several layers (MRS 1000, say): it has no driver"));
  CHECK(rig.notices.size() == told + 1);
}

TEST_CASE("scan data is read past other channels and encoders, and refused when it is cut off anywhere") {
  const Bytes payload = scan_payload({});
  const auto scan = parse_scan_data(payload);
  REQUIRE(scan);
  CHECK(scan->serial_number == 4711);
  CHECK(scan->scan_frequency == 2500);
  CHECK(scan->channels_16_bit == 2);
  REQUIRE(scan->dist1.count == 3);
  CHECK(scan->dist1.start_angle == -50000);
  CHECK(scan->dist1.value(2) == 1002);
  // What follows the channels is not needed; all before it is.
  for (std::size_t size = 0; size + 10 < payload.size(); ++size) {
    CHECK_FALSE(parse_scan_data(std::span(payload).first(size)));
  }
  CHECK_FALSE(parse_scan_data(scan_payload({.content = "DIST2"})));
  CHECK_FALSE(parse_scan_data(scan_payload({.channels = 21})));
  CHECK_FALSE(parse_scan_data(bytes_of("sSN LMDscandata")));
  CHECK_FALSE(parse_scan_data(bytes_of("sSN LIDoutputstate 1234567890123456789012345678901234567890")));
}

TEST_CASE("random scan data never reads beyond its bytes") {
  alces::sim::Random random(9);
  for (int round = 0; round < 20000; ++round) {
    Bytes payload = scan_payload({});
    for (int i = random.integer(1, 6); i > 0; --i) {
      const auto at = static_cast<std::size_t>(random.integer(16, static_cast<int>(payload.size()) - 1));
      payload[at] = static_cast<std::uint8_t>(random.integer(0, 255));
    }
    const auto scan = parse_scan_data(payload);
    if (scan && scan->dist1.count > 0) {
      CHECK(scan->dist1.values.size() == 2 * scan->dist1.count);
      CHECK(scan->dist1.values.data() + scan->dist1.values.size() <= payload.data() + payload.size());
    }
  }
}

TEST_CASE("a rounded angle step is a whole number of rays a turn") {
  CHECK(rays_per_turn(1667) == 2160);
  CHECK(rays_per_turn(3333) == 1080);
  CHECK(rays_per_turn(2500) == 1440);
  CHECK(rays_per_turn(5000) == 720);
  CHECK(rays_per_turn(10000) == 360);
  CHECK(rays_per_turn(0) == 0);
}

TEST_CASE("every telegram of the captures decodes, with counters in a row and sane ranges") {
  struct Expectation {
    std::string file;
    std::uint32_t rays;
    double frequency_hz;
    double first_deg;
    std::size_t scans;
    float reach_m;
  };
  const auto expected =
      GENERATE(values<Expectation>({{"20210301_lms511.pcapng.json", 1141, 25, -95, 136, 80},
                                    {"20210302_lms111.pcapng.json", 541, 50, -135, 172, 20}}));
  const auto packets = capture(expected.file);
  if (packets.empty()) return;
  const bool is_lms1xx = expected.rays == 541;
  Rig rig({.model = is_lms1xx ? Model::lms1xx : Model::lms5xx,
           .scan_frequency_hz = expected.frequency_hz,
           .is_listen_only = true});
  rig.driver.start(0);
  for (const Packet& packet : packets) rig.driver.on_bytes(packet.bytes, packet.stamp_ns);

  CHECK(rig.driver.parser_counters().frames == packets.size());
  CHECK(rig.driver.parser_counters().checksum_errors == 0);
  CHECK(rig.driver.parser_counters().bytes_skipped == 0);
  CHECK(rig.driver.counters().unreadable_scans == 0);
  CHECK(rig.driver.counters().telegrams_missed == 0);
  CHECK(rig.driver.counters().telegrams_repeated == 0);
  CAPTURE(expected.file, rig.profiles.size());
  REQUIRE(rig.profiles.size() == expected.scans);
  std::size_t ranges = 0;
  for (std::size_t n = 0; n < rig.profiles.size(); ++n) {
    const Profile& profile = rig.profiles[n];
    CHECK(profile.count == expected.rays);
    CHECK(profile.first_angle_rad * 57.29577951 == Approx(expected.first_deg));
    for (const float range_m : profile.ranges_m()) {
      CHECK(range_m < expected.reach_m);
      ranges += range_m > 0 ? 1 : 0;
    }
    if (n == 0) continue;
    CHECK(profile.counter == rig.profiles[n - 1].counter + 1);
    if (n > 10) {  // the device's times are even
      const double period_ms =
          1e-6 * static_cast<double>(profile.first_ray_stamp_ns - rig.profiles[n - 1].first_ray_stamp_ns);
      CHECK(period_ms == Approx(1000 / expected.frequency_hz).epsilon(0.1));
    }
  }
  CHECK(ranges > rig.profiles.size() * expected.rays / 2);
}

TEST_CASE("the scans of a TiM are put together from TCP segments") {
  const auto packets = pcapng_stream("test.pcapng");
  if (packets.empty()) return;
  Rig rig({.model = Model::tim, .scan_frequency_hz = 15, .is_listen_only = true});
  rig.driver.start(packets.front().stamp_ns);
  for (const Packet& packet : packets) rig.driver.on_bytes(packet.bytes, packet.stamp_ns);
  CHECK(rig.driver.parser_counters().bytes_skipped == 0);
  CHECK(rig.driver.counters().unreadable_scans == 0);
  CHECK(rig.driver.counters().telegrams_missed == 0);
  REQUIRE(rig.profiles.size() == 16);
  CHECK(rig.profiles[0].count == 811);
  CHECK(rig.profiles[0].first_angle_rad * 57.29577951 == Approx(-135));
  CHECK(rig.profiles[0].angle_step_rad * 57.29577951 == Approx(1.0 / 3));
  for (const float range_m : rig.profiles[7].ranges_m()) CHECK(range_m < 26);
}

TEST_CASE("the start-up dialogue reaches measuring on the answers of the captured lasers") {
  const std::string file = GENERATE("20210301_lms511.pcapng.json", "20210302_lms111.pcapng.json");
  const auto packets = capture(file);
  if (packets.empty()) return;
  Rig rig({.scan_frequency_hz = file.find("111") != std::string::npos ? 50.0 : 25.0});
  std::vector<Packet> scans;
  for (const Packet& packet : packets) {
    const std::string payload(packet.bytes.begin() + 8, packet.bytes.end() - 1);
    const std::string kind = payload.substr(0, 3);
    if (kind == "sAN" || kind == "sWA" || kind == "sEA") {
      rig.answers[payload.substr(4, payload.find(' ', 4) - 4)] = packet.bytes;
    }
    if (payload.compare(0, 15, "sSN LMDscandata") == 0) scans.push_back(packet);
  }
  rig.answers["STlms"] = frame({'s', 'F', 'A', 0, 3});           // the recording host did not ask for it
  rig.answers["LMPoutputRange"] = frame({'s', 'F', 'A', 0, 3});  // nor for this
  rig.driver.start(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::connecting);
  rig.driver.on_link(true, rig.now_ns);
  rig.run(1);
  CHECK(rig.driver.state() == LaserState::measuring);
  CHECK(rig.was_told("does not know a variable"));
  REQUIRE(rig.requests.size() == 7);
  CHECK(rig.requests[0] == "sMN SetAccessMode \x03\xf4\x72\x47\x44");  // as the recording host sent it
  CHECK(rig.requests[6] == "sEN LMDscandata \x01");
  for (const Packet& scan : scans) rig.driver.on_bytes(scan.bytes, rig.now_ns + scan.stamp_ns);
  CHECK(rig.profiles.size() == scans.size());
}

TEST_CASE("a laser that announces more rays than there is room for is not let stream, and is told") {
  const bool sets_scan = GENERATE(false, true);
  Rig rig({.sets_scan = sets_scan, .most_rays = 181});
  rig.answer_everything();
  if (sets_scan) {
    using namespace std::string_literals;
    rig.answer("mLMPsetscancfg",
               "sAN mLMPsetscancfg \0\0\0\x13\x88\0\1\0\0\x13\x88\xff\xf9\x22\x30\0\x22\x55\x10"s);
    rig.answers.erase("LMPoutputRange");
  }
  rig.driver.on_link(true, rig.now_ns);
  rig.driver.start(rig.now_ns);
  rig.run(10);
  CHECK(rig.driver.state() == LaserState::connecting);
  CHECK(rig.was_told("more rays a profile than rays_per_profile has room for; rays"));
  CHECK(rig.notices.size() == 1);
  CHECK(rig.values == std::vector<std::int64_t>{541});
  for (const std::string& request : rig.requests) CHECK(request.find("LMDscandata ") == std::string::npos);
}

TEST_CASE("a laser that does not say how many rays come streams all the same, and so does an old recording") {
  Rig silent({.most_rays = 181});
  silent.answer_everything();
  silent.answers.erase("LMPoutputRange");
  silent.driver.on_link(true, silent.now_ns);
  silent.driver.start(silent.now_ns);
  silent.run(2.5);
  CHECK(silent.driver.state() == LaserState::measuring);
  CHECK(silent.notices == std::vector<std::string>{"measuring"});

  Rig recorded({.most_rays = 181});
  recorded.answer_everything();
  recorded.answers["LMPoutputRange"] = recorded.answers["LMDscandata"];  // what came next then
  recorded.answers.erase("LMDscandata");
  recorded.driver.on_link(true, recorded.now_ns);
  recorded.driver.start(recorded.now_ns);
  recorded.run(0.2);
  CHECK(recorded.driver.state() == LaserState::measuring);
}

TEST_CASE("a laser that is not ready yet is waited for") {
  Rig rig({});
  rig.answer_everything();
  using namespace std::string_literals;
  rig.answer("STlms", "sRA STlms \0\3\0"s);
  rig.driver.on_link(true, rig.now_ns);
  rig.driver.start(rig.now_ns);
  rig.run(20);
  CHECK(rig.driver.state() == LaserState::configuring);
  CHECK(std::string(rig.driver.reason()) == "waiting until the laser measures");
  rig.answer_everything();
  rig.run(1);
  CHECK(rig.driver.state() == LaserState::measuring);
}

TEST_CASE("frequency and resolution are set when configured, and a refusal is told") {
  Rig rig({.model = Model::lms1xx,
           .scan_frequency_hz = 50,
           .sets_scan = true,
           .angle_step_deg = 0.5,
           .start_angle_deg = -45,
           .stop_angle_deg = 225});
  rig.answer_everything();
  rig.driver.on_link(true, rig.now_ns);
  rig.driver.start(rig.now_ns);
  rig.run(1);
  CHECK(rig.driver.state() == LaserState::measuring);
  const std::string expected(
      "sMN mLMPsetscancfg \x00\x00\x13\x88\x00\x01\x00\x00\x13\x88\xff\xf9\x22\x30\x00\x22\x55\x10", 37);
  CHECK(rig.requests[1] == expected);

  Rig refused({.sets_scan = true});
  refused.answer_everything();
  refused.answer("mLMPsetscancfg", "sAN mLMPsetscancfg \2");
  refused.driver.on_link(true, refused.now_ns);
  refused.driver.start(refused.now_ns);
  refused.run(20);
  CHECK(refused.driver.state() == LaserState::connecting);
  CHECK(refused.was_told("refuses frequency, resolution or field of view"));
  CHECK(refused.notices.size() == 1);
}

TEST_CASE("error answers are told with their text, silence and a lost connection start the dialogue again") {
  Rig rig({});
  rig.answer_everything();
  rig.answers["SetAccessMode"] = frame({'s', 'F', 'A', 0, 1});
  rig.driver.on_link(true, rig.now_ns);
  rig.driver.start(rig.now_ns);
  rig.run(0.5);
  CHECK(rig.driver.state() == LaserState::connecting);
  CHECK(rig.was_told("access denied"));
  rig.answer_everything();
  for (int i = 0; i < 30 && rig.driver.state() != LaserState::measuring; ++i) rig.run(0.1);
  CHECK(rig.driver.state() == LaserState::measuring);
  rig.answers.clear();
  rig.run(2);
  CHECK(rig.driver.counters().silences == 1);
  CHECK(rig.driver.state() == LaserState::configuring);
  rig.run(10);
  CHECK(rig.was_told("does not answer"));
  rig.driver.on_link(false, rig.now_ns);
  CHECK(rig.driver.state() == LaserState::connecting);
  rig.run(1);
  rig.answer_everything();
  rig.driver.on_link(true, rig.now_ns);
  rig.run(0.5);
  CHECK(rig.driver.state() == LaserState::measuring);

  using namespace std::string_literals;
  rig.answer("LMDscandata", "sEA LMDscandata \0"s);
  rig.driver.stop(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::stopping);
  rig.run(0.1);
  CHECK(rig.driver.state() == LaserState::stopped);
  CHECK(rig.requests.back() == "sEN LMDscandata \0"s);
}

TEST_CASE("missed and repeated telegrams are counted, reserved values are no ranges, scale is applied") {
  Rig rig({.is_listen_only = true});
  rig.driver.start(rig.now_ns);
  std::uint32_t start_us = 1000;
  const auto feed = [&](std::uint16_t counter, float scale = 1) {
    rig.driver.on_bytes(frame(scan_payload({.telegram_counter = counter,
                                            .start_us = start_us,
                                            .transmission_us = start_us + 41000,
                                            .scale = scale})),
                        rig.now_ns);
    start_us += 40000;
    rig.now_ns += 40 * ns_per_ms;
  };
  feed(0xfffe);
  feed(0xffff);
  feed(2);
  feed(2);
  feed(3, 2);
  CHECK(rig.driver.counters().telegrams_missed == 2);
  CHECK(rig.driver.counters().telegrams_repeated == 1);
  REQUIRE(rig.profiles.size() == 4);
  CHECK(rig.profiles[2].counter == rig.profiles[1].counter + 3);
  CHECK(rig.profiles[3].range_m[0] == Approx(2.0));
  CHECK(rig.profiles[3].range_m[1] == 0);
  CHECK(rig.driver.counters().rays_without_range == 4);
  rig.driver.on_bytes(frame(scan_payload({.count = 1201, .channels = 1})), rig.now_ns);
  CHECK(rig.driver.counters().unreadable_scans == 1);
  CHECK(rig.was_told("scan data cannot be used"));
  const std::size_t told = rig.notices.size();
  rig.driver.on_bytes(frame(scan_payload({.count = 1201, .channels = 1})), rig.now_ns);
  CHECK(rig.notices.size() == told);
  rig.driver.on_bytes(frame(scan_payload({.count = 1201, .channels = 1})), rig.now_ns + 30 * ns_per_s);
  CHECK(rig.notices.size() == told + 1);
}

TEST_CASE(
    "stamps follow the device's microseconds through their wrap-around, late arrivals notwithstanding") {
  Rig rig({.is_listen_only = true});
  rig.driver.start(0);
  alces::sim::Random random(2);
  const std::int64_t first_us = 0xffffffffLL - 100'000'000;  // wraps after 100 s
  for (std::int64_t n = 0; n < 25 * 200; ++n) {
    const std::int64_t start_us = first_us + n * 40'000;
    const std::int64_t true_ns = ns_per_s + n * 40 * ns_per_ms + n * 400;  // the device is 10 ppm slow
    const std::int64_t latency_ns = random.integer(100'000, 300'000) + (random.chance(0.1) ? 30'000'000 : 0);
    rig.profiles.clear();
    rig.driver.on_bytes(
        frame(scan_payload({.telegram_counter = static_cast<std::uint16_t>(n),
                            .start_us = static_cast<std::uint32_t>(start_us),
                            .transmission_us = static_cast<std::uint32_t>(start_us + 41'000)})),
        true_ns + 41 * ns_per_ms + latency_ns);
    REQUIRE(rig.profiles.size() == 1);
    if (n < 250) continue;
    // -5 deg comes 85 deg after the zero index at -90 deg.
    const double expected_ns = static_cast<double>(true_ns) + 40e6 * 85 / 360 + 100e3;
    CHECK(std::abs(static_cast<double>(rig.profiles[0].first_ray_stamp_ns) - expected_ns) < 50e3);
  }
}

TEST_CASE("a CoLa B configuration that cannot be is refused with its reason") {
  CHECK(alces::validate(ColaBConfig{}) == nullptr);
  CHECK(alces::validate(ColaBConfig{.scan_frequency_hz = 0}) != nullptr);
  CHECK(alces::validate(ColaBConfig{.model = Model::tim, .sets_scan = true}) != nullptr);
  CHECK(alces::validate(ColaBConfig{.sets_scan = true, .start_angle_deg = 10, .stop_angle_deg = 0}) !=
        nullptr);
  for (std::uint32_t code = 0; code < 40; ++code) CHECK(std::string(error_text(code)).size() > 10);
  CHECK(std::string(error_text(1)).find("access denied") != std::string::npos);
}
