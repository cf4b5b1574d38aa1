#include "shared_link_sums.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <type_traits>

#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

// What rank 0 asks for; bytes of this machine: all ranks are of one kind.
struct Request {
  LinkPass pass;
  std::vector<ScanLink> links;
  std::vector<Pose> map_from_scan;
};

template <typename T>
void put(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

template <typename T>
T take(const std::string& bytes, std::size_t& at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  at += sizeof(value);
  return value;
}

std::string to_bytes(std::span<const ScanLink> links, std::span<const Pose> map_from_scan,
                     const LinkPass& pass) {
  std::string bytes;
  put(bytes, pass);
  put(bytes, links.size());
  for (const ScanLink& link : links) put(bytes, link);
  put(bytes, map_from_scan.size());
  for (const Pose& pose : map_from_scan) {
    for (Eigen::Index i = 0; i < 4; ++i) put(bytes, pose.rotation.coeffs()[i]);
    for (Eigen::Index i = 0; i < 3; ++i) put(bytes, pose.translation_m[i]);
  }
  return bytes;
}

Request from_bytes(const std::string& bytes) {
  Request request;
  std::size_t at = 0;
  request.pass = take<LinkPass>(bytes, at);
  request.links.resize(take<std::size_t>(bytes, at));
  for (ScanLink& link : request.links) link = take<ScanLink>(bytes, at);
  request.map_from_scan.resize(take<std::size_t>(bytes, at));
  for (Pose& pose : request.map_from_scan) {
    for (Eigen::Index i = 0; i < 4; ++i) pose.rotation.coeffs()[i] = take<double>(bytes, at);
    for (Eigen::Index i = 0; i < 3; ++i) pose.translation_m[i] = take<double>(bytes, at);
  }
  return request;
}

// Of `links`, those of one rank: [first, second).
std::pair<std::size_t, std::size_t> stretch(std::size_t links, std::size_t rank, std::size_t ranks) {
  return {links * rank / ranks, links * (rank + 1) / ranks};
}

constexpr char sums_follow = 's';
constexpr char problem_follows = 'p';

// This rank's answer: its sums, or what went wrong.
std::string answer(ProcessGroup& group, LinkSumSource& own, std::span<const ScanLink> links,
                   std::span<const Pose> map_from_scan, const LinkPass& pass,
                   const LinkSumSource::Progress& progress) {
  const auto [first, last] = stretch(links.size(), group.rank(), group.size());
  const auto problem = [](int status, const char* sentence) {
    std::string bytes(1, problem_follows);
    put(bytes, status);
    return bytes + sentence;
  };
  try {
    std::vector<LinkSums> sums(last - first);
    own.sum(links.subspan(first, last - first), map_from_scan, pass, sums, progress);
    std::string bytes(1, sums_follow);
    bytes.append(reinterpret_cast<const char*>(sums.data()), sums.size() * sizeof(LinkSums));
    return bytes;
  } catch (const Error& error) {
    return problem(error.exit_status(), error.what());
  } catch (const std::bad_alloc&) {
    return problem(4, "a machine of the group has not enough memory for its share; load fewer scans at once");
  } catch (const std::exception& error) {
    return problem(1, error.what());
  }
}

}  // namespace

SharedLinkSums::~SharedLinkSums() {
  std::string release;
  group_.broadcast(release);
}

void SharedLinkSums::sum(std::span<const ScanLink> links, std::span<const Pose> map_from_scan,
                         const LinkPass& pass, std::span<LinkSums> sums, const Progress& progress) {
  std::string request = to_bytes(links, map_from_scan, pass);
  group_.broadcast(request);
  const std::size_t ranks = group_.size();
  const Progress all = [&](std::size_t done, std::size_t) {  // the others are about as far
    if (progress) progress(std::min(links.size(), done * ranks), links.size());
  };
  const std::vector<std::string> answers =
      group_.gather(answer(group_, own_, links, map_from_scan, pass, all));
  for (std::size_t rank = 0; rank < ranks; ++rank) {
    const std::string& bytes = answers[rank];
    std::size_t at = 1;
    if (!bytes.empty() && bytes.front() == problem_follows) {
      const int status = take<int>(bytes, at);
      throw Error(bytes.substr(at), status);
    }
    const auto [first, last] = stretch(links.size(), rank, ranks);
    if (bytes.size() != 1 + (last - first) * sizeof(LinkSums))
      throw Error(
          "a process of the group answered with something else than its sums; run the same build on all "
          "machines",
          1);
    if (last > first) std::memcpy(&sums[first], bytes.data() + 1, (last - first) * sizeof(LinkSums));
  }
}

void serve_link_sums(ProcessGroup& group, LinkSumSource& own) {
  for (;;) {
    std::string bytes;
    group.broadcast(bytes);
    if (bytes.empty()) return;
    const Request request = from_bytes(bytes);
    (void)group.gather(answer(group, own, request.links, request.map_from_scan, request.pass, {}));
  }
}

void refuse_link_sums(ProcessGroup& group, const std::string& problem) {
  for (;;) {
    std::string bytes;
    group.broadcast(bytes);
    if (bytes.empty()) return;
    std::string refusal(1, problem_follows);
    put(refusal, 3);
    (void)group.gather(refusal + problem);
  }
}

}  // namespace alces::offline
