"""Which of them do in a step: depth, direction, triangle and weights of each contact."""
