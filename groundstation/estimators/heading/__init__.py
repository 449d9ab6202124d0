"""System 1: INS heading error from straight taxi before take-off (Markelov, Kostishin, Shukalov, 2015)."""
