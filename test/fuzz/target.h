// What is fuzzed: a function over bytes that no input may crash, hang, or make wrong.
//
// Targets register themselves by name. libFuzzer runs one of them in a program of its own
// (libfuzzer_entry.cpp, preset `fuzz`); the suite replays all corpora in one program (replay_main.cpp), with
// whatever compiler it was built by.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string_view>

namespace alces::fuzz {

struct Target {
  const char* name;
  void (*run)(std::span<const std::uint8_t> bytes);
  Target* next = nullptr;  ///< all are one chain
};

inline Target* first_target = nullptr;

class Registration {
 public:
  explicit Registration(Target& target) {
    target.next = first_target;
    first_target = &target;
  }
};

/// nullptr: there is none of that name.
inline Target* find_target(std::string_view name) {
  for (Target* target = first_target; target != nullptr; target = target->next) {
    if (name == target->name) return target;
  }
  return nullptr;
}

/// What must hold for every input.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

}  // namespace alces::fuzz

/// ALCES_FUZZ_TARGET(pcd) { ... } defines a target; its input is called `bytes`.
#define ALCES_FUZZ_TARGET(name)                                                \
  static void fuzz_##name(std::span<const std::uint8_t> bytes);                \
  static ::alces::fuzz::Target target_##name{#name, fuzz_##name};              \
  static const ::alces::fuzz::Registration registration_##name(target_##name); \
  static void fuzz_##name(std::span<const std::uint8_t> bytes)
