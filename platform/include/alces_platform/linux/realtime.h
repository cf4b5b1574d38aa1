// What the scheduler and the memory manager are asked for on request. Each call is for the calling thread
// (lock_memory: the process); each answers an empty message when it is done, and otherwise one sentence that
// says what was not permitted and what to change. Going on without is possible: stamps come from the kernel,
// only latency suffers. Sources: sched(7), mlockall(2), capabilities(7), systemd.exec(5).
#pragma once

#include "alces_platform/linux/message.h"

namespace alces {

/// SCHED_FIFO at `priority`, 1 to 99. Threads started afterwards do not inherit it (SCHED_RESET_ON_FORK): the
/// mapping thread is not to starve the machine.
[[nodiscard]] Message set_fifo_priority(int priority);

/// All pages of now and of later stay in memory. Later ones too: thread stacks (8 MiB each by default) and
/// large allocations fail once a limit is reached, so call it after set-up.
[[nodiscard]] Message lock_memory();

/// The thread runs on this processor only, counted from 0.
[[nodiscard]] Message pin_to_processor(int processor);

}  // namespace alces
