// Several processes at one task, on one machine or many: what the relaxation needs of them.
//
// Each runs the same command. Rank 0 leads; the others answer. Without mpirun there is one. `alces` has the
// SingleProcess below; `alces-mpi` has one over Open MPI (offline/program/mpi), so that only it needs libmpi.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace alces::offline {

class ProcessGroup {
 public:
  ProcessGroup() = default;
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;
  virtual ~ProcessGroup() = default;

  [[nodiscard]] virtual std::size_t rank() const = 0;
  [[nodiscard]] virtual std::size_t size() const = 0;
  /// Rank 0's bytes, in all ranks. Called by all.
  virtual void broadcast(std::string& bytes) = 0;
  /// The bytes of all ranks in their order, at rank 0; nothing elsewhere. Called by all.
  virtual std::vector<std::string> gather(const std::string& bytes) = 0;
};

class SingleProcess final : public ProcessGroup {
 public:
  [[nodiscard]] std::size_t rank() const override { return 0; }
  [[nodiscard]] std::size_t size() const override { return 1; }
  void broadcast(std::string&) override {}
  std::vector<std::string> gather(const std::string& bytes) override { return {bytes}; }
};

}  // namespace alces::offline
