// Two scans in a pose graph, in a block of memory whose size the compiler works out.
#include <array>
#include <cstddef>
#include <cstdio>

#include "alces/arena.h"
#include "alces/pose_graph.h"

namespace {

constexpr alces::PoseGraph::Capacity capacity{.vertices = 2, .edges = 1};

constexpr std::size_t memory_required() {
  alces::Arena count;
  alces::PoseGraph plan(count, capacity);
  return count.used_bytes();
}

alignas(alces::Arena::alignment) std::array<std::byte, memory_required()> block;

}  // namespace

int main() {
  alces::Arena arena(block);
  alces::PoseGraph graph(arena, capacity);

  alces::Edge edge{.from = 0, .to = 1};
  edge.from_from_to.translation_m = {1.5, 0.0, 0.0};  // the second scan was taken 1.5 m further on

  alces::Status status = graph.add_vertex(alces::Pose{});
  if (status == alces::Status::ok) status = graph.add_vertex(graph.poses()[0] * edge.from_from_to);
  if (status == alces::Status::ok) status = graph.add_edge(edge);
  std::printf("%s: %u scans, %u match, the second at x = %.2f m, %zu bytes\n", alces::text(status),
              graph.vertex_count(), graph.edge_count(), graph.poses()[1].translation_m.x(), block.size());
  return status == alces::Status::ok ? 0 : 1;
}
