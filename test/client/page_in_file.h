// A page in a file, written by the test in place of alcesd.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>

#include "alces/client.h"
#include "alces/page.h"

namespace alces::test {

/// A folder in memory, where there is one.
class PageFolder {
 public:
  PageFolder() {
    const bool has_memory = std::filesystem::is_directory("/dev/shm");
    std::string name = (has_memory ? "/dev/shm" : std::filesystem::temp_directory_path().string()) +
                       "/alces_page_test_XXXXXX";
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  PageFolder(const PageFolder&) = delete;
  PageFolder& operator=(const PageFolder&) = delete;
  ~PageFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::string file(const std::string& name = "page") const { return path_ + "/" + name; }

 private:
  std::string path_;
};

template <typename Payload>
void write_section(std::uint32_t* section, const Payload& payload) {
  std::array<std::uint32_t, sizeof(Payload) / 4> words;
  std::memcpy(words.data(), &payload, sizeof payload);
  alces_page_write(section, words.data(), words.size());
}

template <typename Payload>
void write_entry(std::uint32_t* entry, const Payload& payload) {
  std::array<std::uint32_t, sizeof(Payload) / 4> words;
  std::memcpy(words.data(), &payload, sizeof payload);
  alces_page_store(entry, words.data(), words.size());
}

inline alces_page_rigid rigid(double x, double y, double heading_rad) {
  return {{x, y, 0}, {0, 0, std::sin(heading_rad / 2), std::cos(heading_rad / 2)}};
}

class PageInFile {
 public:
  PageInFile(const std::string& path, std::uint64_t start_id) : path_(path) {
    const std::string made = path + ".new";
    const int file = ::open(made.c_str(), O_RDWR | O_CREAT | O_EXCL, 0644);
    REQUIRE(file >= 0);
    REQUIRE(::ftruncate(file, sizeof(alces_page)) == 0);
    void* const address = ::mmap(nullptr, sizeof(alces_page), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    ::close(file);
    REQUIRE(address != MAP_FAILED);
    page_ = static_cast<alces_page*>(address);
    std::memcpy(page_->head.magic, ALCES_PAGE_MAGIC, sizeof page_->head.magic);
    page_->head.start_id = start_id;
    page_->head.version = ALCES_PAGE_VERSION;
    page_->head.size = sizeof(alces_page);
    page_->head.state = ALCES_PAGE_LIVE;
    REQUIRE(std::rename(made.c_str(), path.c_str()) == 0);
  }
  PageInFile(const PageInFile&) = delete;
  PageInFile& operator=(const PageInFile&) = delete;
  ~PageInFile() { ::munmap(page_, sizeof(alces_page)); }

  [[nodiscard]] alces_page& page() { return *page_; }
  void set_state(std::uint32_t state) { __atomic_store_n(&page_->head.state, state, __ATOMIC_RELEASE); }

  /// The body drives a circle: 1 m/s, a turn of `rate` rad/s.
  static alces_page_rigid on_circle(std::int64_t stamp_ns, double rate_rad_s = 0.5) {
    const double turned = rate_rad_s * static_cast<double>(stamp_ns) * 1e-9;
    return rigid(std::sin(turned) / rate_rad_s, (1 - std::cos(turned)) / rate_rad_s, turned);
  }
  void drive_to(std::int64_t stamp_ns, bool is_connected = true) {
    alces_page_node node{};
    node.sequence = ++odometry.nodes;
    node.stamp_ns = stamp_ns;
    node.odom_from_body = on_circle(stamp_ns);
    node.is_connected = is_connected ? 1 : 0;
    write_entry(page_->nodes[(node.sequence - 1) % ALCES_PAGE_NODES], node);
    odometry.node_stamp_ns = stamp_ns;
    odometry.is_valid = 1;
    ++odometry.odom_from_body.sequence;
    odometry.odom_from_body.stamp_ns = stamp_ns;
    odometry.odom_from_body.parent_from_child = node.odom_from_body;
    odometry.velocity[0] = 1;
    odometry.velocity[5] = 0.5;
    be_alive(stamp_ns);
  }
  void be_alive(std::int64_t now_ns) {
    odometry.alive_ns = now_ns;
    write_section(page_->odometry, odometry);
  }
  /// A scan's pose in a map that lies turned against odom.
  void correct(std::int64_t stamp_ns, const alces_page_rigid& map_from_odom) {
    map.odom_from_body = on_circle(stamp_ns);
    for (alces_page_transform* const transform : {&map.map_from_odom, &map.map_from_body}) {
      ++transform->sequence;
      transform->stamp_ns = transform->published_ns = stamp_ns;
      transform->parent_from_child = map_from_odom;
      for (int i = 0; i < 6; ++i) transform->covariance[7 * i] = i < 3 ? 0.01 : 0.0001;
    }
    write_section(page_->map, map);
  }
  void close_loop(std::uint32_t first, std::uint32_t last) {
    alces_page_event event{};
    event.sequence = map.events + 1;
    event.is_closed = 1;
    event.first_scan = first;
    event.last_scan = last;
    event.correction_m = 0.25;
    std::strcpy(event.verdict, "closed");
    write_entry(page_->events[map.events % ALCES_PAGE_EVENTS], event);
    ++map.events;
    write_section(page_->map, map);
  }

  alces_page_odometry odometry{};
  alces_page_map map{};

 private:
  std::string path_;
  alces_page* page_ = nullptr;
};

/// A client whose clock the test turns.
class ClientAt {
 public:
  explicit ClientAt(const std::string& path) : client_(alces_client_open(path.c_str())) {
    REQUIRE(client_ != nullptr);
    alces_client_set_clock(
        client_, [](void* now) { return *static_cast<std::int64_t*>(now); }, &now_ns);
  }
  ClientAt(const ClientAt&) = delete;
  ClientAt& operator=(const ClientAt&) = delete;
  ~ClientAt() { alces_client_close(client_); }

  [[nodiscard]] int latest(alces_transform transform) {
    return alces_client_latest(client_, transform, &pose);
  }
  [[nodiscard]] int at(alces_transform transform, std::int64_t stamp_ns) {
    return alces_client_pose_at(client_, transform, stamp_ns, &pose);
  }
  [[nodiscard]] int status() { return alces_client_status(client_, &said); }
  [[nodiscard]] int next_event() { return alces_client_next_event(client_, &event); }

  std::int64_t now_ns = 0;
  alces_pose pose{};
  alces_status said{};
  alces_event event{};

 private:
  alces_client* client_;
};

inline constexpr std::int64_t ms = 1'000'000;

}  // namespace alces::test
