// A plugin for qemu-user: counts the instructions of a program, and those between its marks.
//
//   qemu-aarch64 -plugin instruction_counter.so -d plugin PROGRAM
//
// A mark is the system call getppid with two arguments, which the kernel does not look at: 0xA1CE5, and 1
// where a stretch begins, 0 where it ends. (Libraries call getppid too, without them.) At the end: how many
// stretches, their mean, the largest. QEMU's interface (docs/devel/tcg-plugins, version 1) is declared here,
// because Debian ships no header of it.
#include <algorithm>
#include <cinttypes>
#include <cstdint>
#include <cstdio>

extern "C" {
using PluginId = std::uint64_t;
struct qemu_plugin_tb;
struct qemu_info_t;
constexpr int add_u64 = 0;
std::size_t qemu_plugin_tb_n_insns(const qemu_plugin_tb*);
void qemu_plugin_register_vcpu_tb_trans_cb(PluginId, void (*)(PluginId, qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_inline(qemu_plugin_tb*, int operation, void* counter,
                                              std::uint64_t amount);
void qemu_plugin_register_vcpu_syscall_cb(PluginId,
                                          void (*)(PluginId, unsigned cpu, std::int64_t number, std::uint64_t,
                                                   std::uint64_t, std::uint64_t, std::uint64_t, std::uint64_t,
                                                   std::uint64_t, std::uint64_t, std::uint64_t));
void qemu_plugin_register_atexit_cb(PluginId, void (*)(PluginId, void*), void*);
void qemu_plugin_outs(const char*);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;
__attribute__((visibility("default"))) int qemu_plugin_install(PluginId, const qemu_info_t*, int, char**);
}

namespace {

constexpr std::uint64_t mark = 0xA1CE5;
constexpr std::int64_t getppid_arm64 = 173;
constexpr std::int64_t getppid_arm = 64;
constexpr std::int64_t getppid_x86_64 = 110;

// One thread of the guest: two would count into the same number without a lock.
std::uint64_t executed = 0;
std::uint64_t begin = 0;
std::uint64_t stretches = 0;
std::uint64_t sum = 0;
std::uint64_t largest = 0;

void on_translated(PluginId, qemu_plugin_tb* block) {
  qemu_plugin_register_vcpu_tb_exec_inline(block, add_u64, &executed, qemu_plugin_tb_n_insns(block));
}

void on_syscall(PluginId, unsigned, std::int64_t number, std::uint64_t magic, std::uint64_t begins,
                std::uint64_t, std::uint64_t, std::uint64_t, std::uint64_t, std::uint64_t, std::uint64_t) {
  if (number != getppid_arm64 && number != getppid_arm && number != getppid_x86_64) return;
  if (magic != mark) return;
  if (begins != 0) {
    begin = executed;
    return;
  }
  const std::uint64_t stretch = executed - begin;
  sum += stretch;
  largest = std::max(largest, stretch);
  ++stretches;
}

void on_exit(PluginId, void*) {
  char line[200];
  std::snprintf(line, sizeof line,
                "instructions: %" PRIu64 " in all; %" PRIu64 " stretches, mean %" PRIu64 ", largest %" PRIu64
                "\n",
                executed, stretches, stretches == 0 ? 0 : sum / stretches, largest);
  qemu_plugin_outs(line);
}

}  // namespace

int qemu_plugin_install(PluginId id, const qemu_info_t*, int, char**) {
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translated);
  qemu_plugin_register_vcpu_syscall_cb(id, on_syscall);
  qemu_plugin_register_atexit_cb(id, on_exit, nullptr);
  return 0;
}
