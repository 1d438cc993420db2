#include "xplane_bridge/actuation/mixing_files.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace xplane_bridge {

std::optional<core::MixingModel> readMixingFile(const std::string& folder, const std::string& aircraft) {
  const std::string path = core::mixingPath(folder, aircraft);
  std::ifstream file(path);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  try {
    core::MixingModel model = core::mixingFromText(text.str());
    if (model.aircraft != aircraft) {
      throw core::MixingFileError("mixing file: is of aircraft " + model.aircraft + ", expected " + aircraft);
    }
    return model;
  } catch (const core::MixingFileError& error) {
    throw core::MixingFileError(path + ": " + error.what());
  }
}

std::string writeMixingFile(const std::string& folder, const core::MixingModel& model) {
  std::string path = core::mixingPath(folder, model.aircraft);
  const std::string fresh = path + ".new";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::ofstream file(fresh);
  file << core::toText(model);
  file.close();
  if (!file || std::rename(fresh.c_str(), path.c_str()) != 0) {
    throw core::MixingFileError(path + " cannot be written");
  }
  return path;
}

}  // namespace xplane_bridge
