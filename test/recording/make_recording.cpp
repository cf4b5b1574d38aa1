// make_recording FILE EVENTS: a sample drive as a file, and on stdout, as JSON, what is in it, for those who
// check it with other readers. Fails when anything asks for heap memory between create() and finish().
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <vector>

#include "alces_platform/recording/file_sink.h"
#include "alces_platform/recording/recording_writer.h"
#include "recording/sample_drive.h"

namespace {

bool heap_is_forbidden = false;
unsigned heap_calls = 0;

}  // namespace

void* operator new(std::size_t size) {
  if (heap_is_forbidden) ++heap_calls;
  if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

using namespace alces;

alignas(64) std::array<std::byte, 16 << 20> block;

int run(const char* path, std::uint32_t event_count) {
  std::vector<sample::OwnedEvent> events;
  for (std::uint32_t i = 0; i < event_count; ++i) {
    events.push_back(sample::event_at(i));
  }
  FileSink sink;
  if (!sink.open(path)) {
    std::fprintf(stderr, "%s: %s\n", path, std::strerror(sink.error_number()));
    return 1;
  }
  RecordingConfig config;
  config.chunk_bytes = 16384;
  config.chunk_capacity = 5;  // so that the index has pages
  config.can_bus_count = 2;
  config.configuration = sample::configuration;
  config.utc_offset_ns = sample::utc_offset_ns;
  config.begin_stamp_ns = sample::begin_ns;
  RecordingStatus status{};
  RecordingWriter* const writer = RecordingWriter::create(block, config, sink, nullptr, status);
  if (writer == nullptr) {
    std::fprintf(stderr, "%s\n", to_string(status));
    return 1;
  }
  heap_is_forbidden = true;
  for (std::uint32_t i = 0; i < event_count; ++i) {
    events[i].event.bytes = events[i].bytes;
    writer->on_event(events[i].event);
    if (i % 20 == 19) sample::write_results(*writer, i / 20);
  }
  const bool finished = writer->finish();
  heap_is_forbidden = false;
  if (!finished || !sink.close() || heap_calls != 0) {
    std::fprintf(stderr, "finished %d, heap calls %u\n", finished, heap_calls);
    return 1;
  }
  const mcap::Writer::Counters& counters = writer->file_counters();
  std::printf(
      "{\"messages\": %llu, \"chunks\": %llu, \"bytes\": %llu, \"events\": %u, \"begin_ns\": \"%lld\",\n"
      " \"utc_offset_ns\": \"%lld\", \"events_unknown\": %llu}\n",
      static_cast<unsigned long long>(counters.messages_written),  // NOLINT(google-runtime-int): printf's
      static_cast<unsigned long long>(counters.chunks_written),
      static_cast<unsigned long long>(counters.bytes_written), event_count,
      static_cast<long long>(sample::begin_ns), static_cast<long long>(sample::utc_offset_ns),
      static_cast<unsigned long long>(writer->counters().events_unknown));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "make_recording FILE EVENTS\n");
    return 2;
  }
  return run(argv[1], static_cast<std::uint32_t>(std::atoi(argv[2])));
}
