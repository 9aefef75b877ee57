"""What moves: programs of moves, motion profiles, encoders with their imperfections, servo and mechanical play."""
