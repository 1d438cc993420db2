// The fuzz targets' main() where there is no libFuzzer: changes its seeds at random, the same way for the same seed,
// and gives each to the target. Command line and exit codes as libFuzzer's, of which it knows the four options below.
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr const char* kUsage =
    "usage: %s [-runs=N] [-max_total_time=S] [-seed=N] [-max_len=N] FOLDER\n"
    "  FOLDER           its files are the seeds\n"
    "  -runs            so many inputs (default: 100000)\n"
    "  -max_total_time  or until so many seconds have passed\n"
    "  -seed            of the random changes (default: 1)\n"
    "  -max_len         longest input in bytes (default: 6000)\n"
    "An input that ends the program is written to crash-<seed>-<run> in the working directory.\n";

struct Options {
  std::uint64_t runs = 100000, seed = 1, longest = 6000, seconds = std::numeric_limits<std::uint64_t>::max();
  std::string folder;
};

Bytes input;                      // what the target is given now
std::array<char, 64> crash_file;  // where that goes when the target ends the program

void keepInput(int signal) {
  if (std::FILE* file = std::fopen(crash_file.data(), "wb")) {
    std::fwrite(input.data(), 1, input.size(), file);
    std::fclose(file);
  }
  std::fprintf(stderr, "%s: the input that has ended the program\n", crash_file.data());
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

bool take(const char* argument, const char* option, std::uint64_t& value) {
  const std::size_t length = std::strlen(option);
  if (std::strncmp(argument, option, length) != 0) return false;
  char* end = nullptr;
  value = std::strtoull(argument + length, &end, 10);
  return argument[length] != '\0' && *end == '\0';
}

bool read(int argc, char** argv, Options& options) {
  for (int i = 1; i < argc; ++i) {
    if (argv[i][0] != '-') {
      if (!options.folder.empty()) return false;
      options.folder = argv[i];
    } else if (!take(argv[i], "-runs=", options.runs) && !take(argv[i], "-seed=", options.seed) &&
               !take(argv[i], "-max_len=", options.longest) && !take(argv[i], "-max_total_time=", options.seconds)) {
      return false;
    }
  }
  return !options.folder.empty() && options.longest > 0;
}

std::vector<Bytes> seedsIn(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Bytes> seeds;
  for (const auto& path : files) {
    std::ifstream file(path, std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return seeds;
}

class Mutator {
 public:
  Mutator(const std::vector<Bytes>& seeds, std::uint64_t seed, std::size_t longest)
      : seeds_(seeds), longest_(longest), random_(seed) {}

  /// A seed with one to eight changes.
  void next(Bytes& bytes) {
    bytes = seeds_[below(seeds_.size())];
    for (std::size_t left = 1 + below(8); left > 0; --left) change(bytes);
    if (bytes.size() > longest_) bytes.resize(longest_);
  }

 private:
  // Not a distribution of the library: those give other numbers elsewhere.
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(random_() % end); }
  std::ptrdiff_t place(const Bytes& bytes) { return static_cast<std::ptrdiff_t>(below(bytes.size() + 1)); }

  void change(Bytes& bytes) {
    static constexpr std::array<std::uint32_t, 8> kBoundaryWords{
        0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7F800000, 0x7FC00000, 0xC479C000};  // inf, NaN, -999 last
    switch (below(bytes.empty() ? 1 : 7)) {
      case 0:
        bytes.insert(bytes.begin() + place(bytes), 1 + below(8), static_cast<std::uint8_t>(random_()));
        break;
      case 1:
        bytes[below(bytes.size())] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 2:
        bytes[below(bytes.size())] = static_cast<std::uint8_t>(random_());
        break;
      case 3:
        bytes.resize(below(bytes.size() + 1));
        break;
      case 4: {
        const auto from = bytes.begin() + place(bytes);
        bytes.erase(from, from + static_cast<std::ptrdiff_t>(below(static_cast<std::size_t>(bytes.end() - from) + 1)));
        break;
      }
      case 5: {
        const std::uint32_t number = kBoundaryWords[below(kBoundaryWords.size())];
        const std::size_t at = below(bytes.size());
        std::memcpy(bytes.data() + at, &number, std::min(sizeof number, bytes.size() - at));
        break;
      }
      default: {  // a piece of another seed, or of this one again
        const Bytes& other = seeds_[below(seeds_.size())];
        const auto from = other.begin() + place(other);
        const Bytes piece(from,
                          from + static_cast<std::ptrdiff_t>(below(static_cast<std::size_t>(other.end() - from) + 1)));
        bytes.insert(bytes.begin() + place(bytes), piece.begin(), piece.end());
      }
    }
  }

  const std::vector<Bytes>& seeds_;
  std::size_t longest_;
  std::mt19937_64 random_;
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!read(argc, argv, options)) {
    std::fprintf(stderr, kUsage, argv[0]);
    return 2;
  }
  const std::vector<Bytes> seeds = seedsIn(options.folder);
  if (seeds.empty()) {
    std::fprintf(stderr, "%s: %s holds no seed\n", argv[0], options.folder.c_str());
    return 2;
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS}) std::signal(signal, keepInput);
  Mutator mutator(seeds, options.seed, options.longest);
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t run = 0;
  const auto passed = [&] {
    const auto time = std::chrono::steady_clock::now() - start;
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::seconds>(time).count());
  };
  for (; run < options.runs && passed() < options.seconds; ++run) {
    if (run < seeds.size()) {
      input = seeds[run];
    } else {
      mutator.next(input);
    }
    std::snprintf(crash_file.data(), crash_file.size(), "crash-%llu-%llu",
                  static_cast<unsigned long long>(options.seed), static_cast<unsigned long long>(run));
    LLVMFuzzerTestOneInput(input.data(), input.size());
  }
  std::printf("Done %llu runs in %llu second(s)\n", static_cast<unsigned long long>(run),
              static_cast<unsigned long long>(passed()));
  return 0;
}
