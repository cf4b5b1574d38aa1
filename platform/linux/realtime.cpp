#include "alces_platform/linux/realtime.h"

#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <cerrno>
#include <cstring>

namespace alces {

Message set_fifo_priority(int priority) {
  Message message;
  sched_param parameters{};
  parameters.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0) return message;
  if (errno == EPERM) {
    message.set(
        "real-time priority %d is not permitted: set LimitRTPRIO=%d in the unit (or rtprio in "
        "/etc/security/limits.d), or give the program CAP_SYS_NICE",
        priority, priority);
  } else if (errno == EINVAL) {
    message.set("real-time priority %d is not between %d and %d", priority,
                sched_get_priority_min(SCHED_FIFO), sched_get_priority_max(SCHED_FIFO));
  } else {
    message.set("real-time priority %d was refused: %s", priority, std::strerror(errno));
  }
  return message;
}

Message lock_memory() {
  Message message;
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return message;
  const int why = errno;
  if (why == EPERM || why == ENOMEM || why == EAGAIN) {
    rlimit limit{};
    getrlimit(RLIMIT_MEMLOCK, &limit);
    message.set(
        "locking all memory is not permitted beyond %llu KiB: set LimitMEMLOCK=infinity in the unit (ulimit "
        "-l), "
        "or give the program CAP_IPC_LOCK",
        static_cast<unsigned long long>(limit.rlim_cur) / 1024);  // NOLINT(google-runtime-int): printf's
  } else {
    message.set("locking all memory was refused: %s", std::strerror(why));
  }
  return message;
}

Message pin_to_processor(int processor) {
  Message message;
  if (processor < 0 || processor >= CPU_SETSIZE) {
    message.set("processor %d: no machine has this one; they count from 0", processor);
    return message;
  }
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(processor), &set);
  if (sched_setaffinity(0, sizeof set, &set) == 0) return message;
  if (errno == EINVAL) {
    message.set(
        "processor %d is not there, switched off, or not for this program (cpuset): `nproc --all` counts "
        "them, "
        "from 0; AllowedCPUs= in the unit limits them",
        processor);
  } else {
    message.set("processor %d was refused: %s", processor, std::strerror(errno));
  }
  return message;
}

}  // namespace alces
