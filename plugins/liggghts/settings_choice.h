// A keyword with named values for the contact models of LIGGGHTS, e.g. `presliding linear|exponential`.
#ifndef DEMBARK_SETTINGS_CHOICE_H
#define DEMBARK_SETTINGS_CHOICE_H

#include <string>
#include <vector>

#include "engine_access.h"

namespace dembark_liggghts {

class ChoiceSetting : public EnumSetting<int> {
  std::string choices_;

 public:
  ChoiceSetting(const std::string& name, const std::vector<std::string>& values) : EnumSetting<int>(name) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      addOption(values[i], static_cast<int>(i));
      choices_ += (i ? ", " : "") + values[i];
    }
  }
  int parseArguments(char** args) override {
    const int consumed = EnumSetting<int>::parseArguments(args);
    if (consumed < 0) error_message = name + " '" + args[1] + "' is unknown; it can be " + choices_;
    return consumed;
  }
};

/// Register keyword `name`; `target` gets the index of the chosen value, at once that of the default `values[0]`.
inline void register_choice(Settings& settings, const std::string& name, int& target, const std::vector<std::string>& values) {
  Setting*& slot = keywords(settings)[name];
  if (!slot) slot = new ChoiceSetting(name, values);
  ChoiceSetting* setting = static_cast<ChoiceSetting*>(slot);
  setting->registerTarget(target);
  setting->setDefault(values[0]);
}

}  // namespace dembark_liggghts

#endif
