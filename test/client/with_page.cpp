// with_page COMMAND...: runs it beside a page that goes on like alcesd's, named by $PAGE: scans come, and a
// loop was closed. Answers the command's exit status.
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>

#include "alces_drivers/odometry/odometry.h"
#include "alces_onboard/error.h"
#include "alces_onboard/page/live_page.h"
#include "alces_onboard/page/page_file.h"
#include "alces_platform/linux/clock.h"

namespace {

using namespace alces;

void say(onboard::LivePage& page, std::int64_t now_ns) {
  onboard::MapPose pose;
  pose.stamp_ns = now_ns;
  pose.map_from_body.translation_m = {1.25, -2.5, 0.5};
  pose.spread.translation_m2 = 0.03;
  page.publish_pose(pose, now_ns);
  page.publish_odometry(nullptr, {}, now_ns);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  try {
    const std::string path = "/dev/shm/alces_with_page_" + std::to_string(::getpid());
    ::setenv("PAGE", path.c_str(), 1);
    onboard::PageFile file({.path = path, .group = {}});
    onboard::LivePage page(file.page());
    LoopReport loop;
    loop.first = 17;
    loop.last = 402;
    loop.verdict = LoopVerdict::closed;
    loop.correction_m = 0.34;
    page.publish_loop(loop, now_ns(), now_ns());
    say(page, now_ns());
    const pid_t child = ::fork();
    if (child == 0) {
      ::execvp(argv[1], argv + 1);
      ::_exit(127);
    }
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
      say(page, now_ns());
      const std::timespec pause{0, 20'000'000};
      ::nanosleep(&pause, nullptr);
    }
    std::remove(path.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  } catch (const onboard::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
