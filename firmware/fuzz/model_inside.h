/* What the files of the model share. */
#ifndef FUZZ_MODEL_INSIDE_H
#define FUZZ_MODEL_INSIDE_H

#include "model.h"

/* Whether a board may be built with it. */
bool model_is_sound(const struct dcmp_config *config);

/* Change a parameter; the result that PARAMETER_VALUE has. */
uint8_t model_set_parameter(struct model *model, uint32_t id, int32_t value, bool owner);

uint32_t model_whole_ticks(const struct model *model, uint32_t us);
bool model_is_live(const struct model *model);

/* Enter FAULT, if the state is RUN. */
void model_fault_from_run(struct model *model, uint32_t code, int32_t detail);

/* A tick's first part: states, limits, time. `missed`: no DRIVE was accepted since the one before. */
void model_judge_tick(struct model *model, uint32_t counts, bool missed);

#endif
