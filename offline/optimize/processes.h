// The processes that this program is one of: one (single_process.cpp, in `alces`), or those that mpirun
// started (mpi/mpi_processes.cpp, in `alces-mpi`). Which, is a matter of linking.
#pragma once

#include "offline/optimize/lum/process_group.h"

namespace alces::offline {

/// First thing in main, once.
void join_processes(int* argc, char*** argv);
/// Last thing in main. With a status other than 0 rank 0 also ends the others, wherever they are.
void leave_processes(int status);
/// Between the two.
[[nodiscard]] ProcessGroup& processes();

}  // namespace alces::offline
