#include "alces_platform/linux/realtime.h"

#include <grp.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <string>

using namespace alces;

namespace {

/// What `ask` answers in a process without any privilege.
template <class Ask>
std::string unprivileged(Ask ask) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const rlimit none{};
    setrlimit(RLIMIT_RTPRIO, &none);
    setrlimit(RLIMIT_MEMLOCK, &none);
    if (geteuid() == 0 && (setgroups(0, nullptr) != 0 || setgid(65534) != 0 || setuid(65534) != 0)) _exit(1);
    const std::string answer = ask().text();
    _exit(write(ends[1], answer.data(), answer.size()) == static_cast<ssize_t>(answer.size()) ? 0 : 2);
  }
  close(ends[1]);
  std::string answer;
  char buffer[512];
  for (ssize_t count = 0; (count = read(ends[0], buffer, sizeof buffer)) > 0;) {
    answer.append(buffer, static_cast<std::size_t>(count));
  }
  close(ends[0]);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(status == 0);
  return answer;
}

}  // namespace

TEST_CASE("what is not permitted is said in one sentence with the remedy") {
  const std::string priority = unprivileged([] { return set_fifo_priority(50); });
  CHECK(priority.find("real-time priority 50 is not permitted") == 0);
  CHECK(priority.find("LimitRTPRIO=50") != std::string::npos);
  CHECK(priority.find("CAP_SYS_NICE") != std::string::npos);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  WARN("skipped: sanitizers make mlockall() do nothing");
  return;
#endif
  const std::string memory = unprivileged([] { return lock_memory(); });
  CHECK(memory.find("locking all memory is not permitted beyond 0 KiB") == 0);
  CHECK(memory.find("ulimit -l") != std::string::npos);
}

TEST_CASE("priorities and processors that do not exist are named") {
  CHECK(std::string(unprivileged([] { return set_fifo_priority(100); })).find("not between 1 and 99") !=
        std::string::npos);
  CHECK(std::string(pin_to_processor(-1).text()).find("processor -1") == 0);
  CHECK(std::string(pin_to_processor(CPU_SETSIZE).text()).find("no machine has this one") !=
        std::string::npos);
  CHECK(std::string(unprivileged([] { return pin_to_processor(CPU_SETSIZE - 1); })).find("is not there") !=
        std::string::npos);
}

TEST_CASE("a thread is pinned to the processor asked for") {
  cpu_set_t before;
  REQUIRE(sched_getaffinity(0, sizeof before, &before) == 0);
  int processor = 0;
  while (!CPU_ISSET(static_cast<std::size_t>(processor), &before)) ++processor;
  CHECK(pin_to_processor(processor).empty());
  cpu_set_t now;
  REQUIRE(sched_getaffinity(0, sizeof now, &now) == 0);
  CHECK(CPU_COUNT(&now) == 1);
  CHECK(CPU_ISSET(static_cast<std::size_t>(processor), &now));
  REQUIRE(sched_setaffinity(0, sizeof before, &before) == 0);
}

TEST_CASE("a message that is too long is cut and says so") {
  Message message;
  message.set("%s", std::string(1000, 'x').c_str());
  const std::string text = message.text();
  CHECK(text.size() == Message::capacity - 1);
  CHECK(text.ends_with("x..."));
  message.set("short %d", 7);
  CHECK(std::string(message.text()) == "short 7");
}
