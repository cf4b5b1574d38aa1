// Ranks of Open MPI (MPI 2 and later: any other will do).
#include <mpi.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "processes.h"

namespace alces::offline {
namespace {

constexpr int root = 0;
constexpr int piece_tag = 1;
constexpr std::uint64_t largest_piece = std::uint64_t{1} << 30;  // counts are int

class MpiProcesses final : public ProcessGroup {
 public:
  MpiProcesses() {
    int rank = 0;
    int size = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    rank_ = static_cast<std::size_t>(rank);
    size_ = static_cast<std::size_t>(size);
  }
  [[nodiscard]] std::size_t rank() const override { return rank_; }
  [[nodiscard]] std::size_t size() const override { return size_; }

  void broadcast(std::string& bytes) override {
    std::uint64_t length = bytes.size();
    MPI_Bcast(&length, 1, MPI_UINT64_T, root, MPI_COMM_WORLD);
    bytes.resize(length);
    for (std::uint64_t at = 0; at < length; at += largest_piece)
      MPI_Bcast(bytes.data() + at, piece(length - at), MPI_CHAR, root, MPI_COMM_WORLD);
  }

  std::vector<std::string> gather(const std::string& bytes) override {
    std::uint64_t length = bytes.size();
    std::vector<std::uint64_t> lengths(rank_ == 0 ? size_ : 0);
    MPI_Gather(&length, 1, MPI_UINT64_T, lengths.data(), 1, MPI_UINT64_T, root, MPI_COMM_WORLD);
    if (rank_ != 0) {
      for (std::uint64_t at = 0; at < length; at += largest_piece)
        MPI_Send(bytes.data() + at, piece(length - at), MPI_CHAR, root, piece_tag, MPI_COMM_WORLD);
      return {};
    }
    std::vector<std::string> all;
    all.push_back(bytes);
    for (std::size_t from = 1; from < size_; ++from) {
      std::string answer(lengths[from], '\0');
      for (std::uint64_t at = 0; at < lengths[from]; at += largest_piece)
        MPI_Recv(answer.data() + at, piece(lengths[from] - at), MPI_CHAR, static_cast<int>(from), piece_tag,
                 MPI_COMM_WORLD, MPI_STATUS_IGNORE);
      all.push_back(std::move(answer));
    }
    return all;
  }

 private:
  static int piece(std::uint64_t left) { return static_cast<int>(std::min(left, largest_piece)); }

  std::size_t rank_ = 0;
  std::size_t size_ = 1;
};

}  // namespace

void join_processes(int* argc, char*** argv) {
  int provided = 0;
  MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &provided);  // one thread talks, others work
}

void leave_processes(int status) {
  if (status != 0 && processes().rank() == 0 && processes().size() > 1) MPI_Abort(MPI_COMM_WORLD, status);
  MPI_Finalize();
}

ProcessGroup& processes() {
  static MpiProcesses all;
  return all;
}

}  // namespace alces::offline
